"""Speed and accuracy beside other tools: ``python -m benchmarks [TOPIC ...] [--json FILE]``."""
