"""The axes of a log by the names of its columns."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from stickslip.logs.columns.words import Meaning, meaning, words_of
from stickslip.logs.table import Table


@dataclass(frozen=True, kw_only=True)
class Discovery:
    """Columns of a log that are channels by their names."""

    meanings: tuple[Meaning, ...]

    @cached_property
    def by_column(self) -> dict[str, Meaning]:
        """Meaning of each column that has one."""
        return {each.column: each for each in self.meanings}

    @cached_property
    def axes(self) -> tuple[str, ...]:
        """Axes that have a position and an effort, in the order of the file."""
        names = dict.fromkeys(each.axis for each in self.meanings)
        return tuple(
            name
            for name in names
            if self.candidates("position", name) and self.candidates("effort", name)
        )

    def candidates(self, channel: str, axis: str | None = None) -> list[Meaning]:
        """Return the columns that may be a channel of an axis, or of any axis for None.

        Commanded motion is none. A measured torque or force comes before a commanded one, either
        before a current, and a torque that is worded as such before a drive's load.
        """
        if channel == "time":
            found = self._found("time", "" if axis else axis)
            found += self._found("time", axis) if axis else []
            stamps = [each for each in found if each.stamp]
            return stamps or found
        found = self._found(channel, axis)
        if channel != "effort":
            return [each for each in found if each.source != "commanded"]
        return _most_direct(found)

    def unused(self, channel: str, axis: str) -> list[Meaning]:
        """Return columns of a channel of an axis that are not taken for it."""
        taken = {each.column for each in self.candidates(channel, axis)}
        return [each for each in self._found(channel, axis) if each.column not in taken]

    @cached_property
    def _index(self) -> dict[tuple[str, str | None], list[Meaning]]:
        index: dict[tuple[str, str | None], list[Meaning]] = {}
        for each in self.meanings:
            index.setdefault((each.channel, each.axis), []).append(each)
            index.setdefault((each.channel, None), []).append(each)
        return index

    def _found(self, channel: str, axis: str | None) -> list[Meaning]:
        return list(self._index.get((channel, axis), []))


def discover(table: Table) -> Discovery:
    """Return what the columns of a table are by their names."""
    found = [each for name in table.headers if (each := meaning(table, name)) is not None]
    found = _with_desired(table, found)
    return Discovery(meanings=tuple(_joined(_without_common_words(found))))


def _with_desired(table: Table, found: Sequence[Meaning]) -> list[Meaning]:
    """Mark columns as commanded whose name is that of another column plus a final ``d``: desired.

    Examples are q_d and tau_J_d beside q and tau_J. The d of a current is that of the d-axis.
    """
    names = {words_of(header) for header in table.headers.values()}
    marked: list[Meaning] = []
    for each in found:
        measured = _without_final_d(words_of(table.headers[each.column]))
        if each.source == "" and not each.current and measured in names:
            axis = " ".join(word for word in each.axis.split() if word != "d")
            marked.append(replace(each, source="commanded", axis=axis))
        else:
            marked.append(each)
    return marked


def _without_final_d(words: tuple[str, ...]) -> tuple[str, ...] | None:
    """Return the words of a name without a final ``d``, which numbers may follow; None without."""
    last = next((k for k in reversed(range(1, len(words))) if not words[k].isdigit()), None)
    if last is None or words[last] != "d":
        return None
    return (*words[:last], *words[last + 1 :])


def _most_direct(found: list[Meaning]) -> list[Meaning]:
    """Return the efforts of each axis that need the fewest conversions, measured ones first."""
    ranks: dict[str, tuple[bool, bool]] = {}
    for each in found:
        rank = (each.current, each.source == "commanded")
        ranks[each.axis] = min(rank, ranks.get(each.axis, rank))
    return [
        each for each in found if (each.current, each.source == "commanded") == ranks[each.axis]
    ]


def _without_common_words(found: Sequence[Meaning]) -> list[Meaning]:
    """Remove the words from the names of axes with which all of them begin."""
    names = [each.axis.split() for each in found if each.channel in {"position", "effort"}]
    distinct = {tuple(name) for name in names}
    common = 0
    if len(distinct) > 1:
        shortest = min(map(len, names))
        while common < shortest and len({name[common] for name in names}) == 1:
            common += 1
    if not common:
        return list(found)
    prefix = names[0][:common]
    return [
        replace(each, axis=" ".join(words[common:]))
        if (words := each.axis.split())[:common] == prefix
        else each
        for each in found
    ]


def _joined(found: list[Meaning]) -> list[Meaning]:
    """Give one axis to all channels where only some of the names have words of an axis."""

    def names(channel: str) -> set[str]:
        return {
            each.axis
            for each in found
            if each.channel == channel and (channel == "effort" or each.source != "commanded")
        }

    position, effort = names("position"), names("effort")
    if position & effort or len(position) != 1 or len(effort) != 1:
        return found
    ((one,), (other,)) = position, effort
    if one and other:
        return found
    named = one or other
    return [
        replace(each, axis=named) if not each.axis and each.channel != "time" else each
        for each in found
    ]
