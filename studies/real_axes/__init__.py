"""Judge `stickslip.identify` on public logs of real axes: ``python -m studies.real_axes``."""
