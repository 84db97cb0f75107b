"""Result of a joint fit in words and records."""

from collections.abc import Sequence
from dataclasses import replace

from stickslip.estimation.joint.consistency import Consistency
from stickslip.estimation.joint.members import Member
from stickslip.estimation.joint.model import JointModel
from stickslip.estimation.selection.summary import selection_of
from stickslip.estimation.selection.terms import DELAY
from stickslip.records import (
    AxisLog,
    JointLog,
    JointLogs,
    LogDeviation,
    ModelSelection,
    TermScore,
    in_words,
    share_text,
    unit_text,
)

_OWN_WORDS = {
    DELAY: "a delay of the effort",
    "offset drift": "a drift of the offset",
    "friction drift": "a drift of friction",
    "gain drift": "a drift of the gain",
}


def joint_selection(
    model: JointModel, members: Sequence[Member], further: TermScore | None = None
) -> ModelSelection:
    """Return the selection with its summary."""
    first = members[0]
    found = selection_of(model, first.motions, None, first.log.effort_kind, further)
    own = ["an offset"] if model.offset else []
    own += [word for name, word in _OWN_WORDS.items() if name in model.names]
    levels = ", ".join(
        f"{level:.3g} in {log}" for log, level in zip(model.logs, model.levels, strict=True)
    )
    unit = members[0].log.log.unit("effort")
    each = f"Each log has {_listed(own)} of its own. " if own else ""
    return replace(
        found,
        summary=f"One model for {len(members)} logs. {found.summary} {each}Residual of a "
        f"window [{unit}]: {levels}; rows are weighted by its inverse.",
        reference_time=0.0,
    )


def _listed(words: Sequence[str]) -> str:
    return " and ".join(filter(None, (", ".join(words[:-1]), words[-1])))


def difference_texts(
    consistency: Consistency, model: JointModel, log: AxisLog
) -> tuple[list[str], list[str]]:
    """Return the differences between the logs in words: those that matter, and the others.

    ``log`` is one of the logs.
    """
    texts = [
        (each.material, difference_text(each, model.logs, log.unit(each.parameter)))
        for each in consistency.deviations
    ]
    matter = [text for material, text in texts if material]
    return matter, [text for material, text in texts if not material]


def difference_text(deviation: LogDeviation, logs: Sequence[str], unit: str) -> str:
    """Return in words by how much one of the named logs differs, and the remedy."""
    others = "the others" if len(logs) > 2 else logs[0]
    what = in_words(deviation.parameter)
    if deviation.relative > -1.0:
        size = share_text(abs(deviation.relative))
        side = "more" if deviation.relative > 0 else "less"
        sentence = f"{deviation.log} shows {size} {side} {what} than {others}"
    else:  # of zero or of the other sign
        value = deviation.difference / deviation.relative
        unit = unit_text(unit)
        article = "an" if what.startswith(("a", "e", "i", "o")) else "a"
        sentence = (
            f"{deviation.log} shows {article} {what} of {value + deviation.difference:.2g} {unit}, "
            f"{others} {value:.2g} {unit}"
        )
    sentence += f" (p = {deviation.p_value:.1g})"
    if not deviation.material:
        return f"{sentence}; the intervals allow for it"
    alone = "identify it alone" if len(logs) > 2 else "identify each log alone"
    return f"{sentence}; {alone}, and look for what changed between the logs"


def joint_logs(
    members: Sequence[Member], model: JointModel, consistency: Consistency, error_rate: float
) -> JointLogs:
    """Return the record of the logs and of their consistency."""
    logs = [each.log.log for each in members]
    return JointLogs(
        logs=tuple(
            JointLog(
                name=log.name,
                samples=len(log),
                duration=float(log.time[-1] - log.time[0]),
                sampling_time=log.sampling_time,
                residual=level,
                effort_delay=part.delay * part.weight.sampling_time,
                reference_time=each.middle,
                effort_kind=each.log.effort_kind,
            )
            for log, each, part, level in zip(
                logs, members, model.rows.parts, model.levels, strict=True
            )
        ),
        p_value=consistency.p_value,
        error_rate=error_rate,
        deviations=consistency.deviations,
    )
