"""XML as text: where its elements stand, and edits that leave every other byte as it is."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from xml.parsers import expat
from xml.sax.saxutils import escape

from stickslip.export.base import choices
from stickslip.records import InputError

_ATTRIBUTE = re.compile(rb"""\s+([^\s=<>/]+)\s*=\s*("[^"]*"|'[^']*')""")
_ROOTS = {"robot": "URDF", "sdf": "SDF", "mujoco": "MJCF"}
MARK = "stickslip: "
"""Beginning of the comments that an export writes, which a later export replaces."""


@dataclass(kw_only=True)
class Element:
    """An element, or a comment (of the tag ``#comment``), and its place in the text [bytes]."""

    tag: str
    attributes: dict[str, str]
    start: int  # of "<"
    opened: int  # after ">" of the start tag
    end: int = 0  # after the element
    closing: int = 0  # of "<" of the end tag; `end` of an empty element
    text: str = ""
    children: list["Element"] = field(default_factory=list)
    parent: "Element | None" = None

    def walk(self) -> Iterator["Element"]:
        """Yield the element and all within it, in the order of the text."""
        yield self
        for child in self.children:
            yield from child.walk()

    def child(self, tag: str) -> "Element | None":
        """Return the first child of a tag."""
        return next((each for each in self.children if each.tag == tag), None)

    def ancestors(self) -> Iterator["Element"]:
        """Yield the elements around it, the innermost first."""
        around = self.parent
        while around is not None:
            yield around
            around = around.parent


@dataclass(frozen=True, kw_only=True)
class Edit:
    """Replacement of the bytes from ``start`` to ``end``."""

    start: int
    end: int
    content: bytes


class XmlText:
    """The text of an XML file, its elements, and edits of it.

    ``what`` is the name of its format in messages. Raises `InputError` if the content is not XML,
    of another format, or in an encoding that is not a superset of ASCII.
    """

    def __init__(self, content: bytes, what: str) -> None:
        self.content = content
        self.what = what
        self.newline = b"\r\n" if b"\r\n" in content else b"\n"
        self.root = self._parsed()
        other = _ROOTS.get(self.root.tag, what)
        if other != what:
            raise InputError("other_robot_format", found=other, root=self.root.tag, format=what)

    def _parsed(self) -> Element:
        if self.content[:2] in (b"\xff\xfe", b"\xfe\xff"):
            raise InputError("encoding_not_edited", encoding="UTF-16")
        parser = expat.ParserCreate()
        document = Element(tag="#document", attributes={}, start=0, opened=0)
        stack = [document]

        def add(element: Element) -> None:
            element.parent = stack[-1]
            stack[-1].children.append(element)

        def start(tag: str, attributes: dict[str, str]) -> None:
            at = parser.CurrentByteIndex
            element = Element(
                tag=tag, attributes=attributes, start=at, opened=self._tag_end(at, tag)
            )
            add(element)
            stack.append(element)

        def end(_tag: str) -> None:
            element, at = stack.pop(), parser.CurrentByteIndex
            if self.content[element.opened - 2 : element.opened] == b"/>":
                element.closing = element.end = element.opened
            else:
                element.closing = at
                element.end = self.content.index(b">", at) + 1

        def comment(text: str) -> None:
            at = parser.CurrentByteIndex
            after = self.content.index(b"-->", at) + 3
            add(
                Element(
                    tag="#comment",
                    attributes={},
                    start=at,
                    opened=after,
                    closing=after,
                    end=after,
                    text=text,
                )
            )

        parser.StartElementHandler = start
        parser.EndElementHandler = end
        parser.CommentHandler = comment
        try:
            parser.Parse(self.content, True)
        except (expat.ExpatError, ValueError) as error:
            raise InputError("not_xml", reason=str(error), format=self.what) from error
        return next(each for each in document.children if each.tag != "#comment")

    def _tag_end(self, start: int, tag: str) -> int:
        """Return the place after a start tag, whose attribute values may contain ``>``."""
        if not self.content.startswith(b"<", start):
            raise InputError("entity_not_edited", tag=tag)
        quote = b""
        for at in range(start, len(self.content)):
            character = self.content[at : at + 1]
            if quote:
                quote = b"" if character == quote else quote
            elif character in b"\"'":
                quote = character
            elif character == b">":
                return at + 1
        return len(self.content)

    def elements(self, tag: str) -> Iterator[Element]:
        """Yield every element of a tag."""
        return (each for each in self.root.walk() if each.tag == tag)

    def joint(self, name: str, candidates: Sequence[Element], hint: str = "") -> Element:
        """Return the joint of a name among candidates; none and several are refused."""
        found = [each for each in candidates if each.attributes.get("name") == name]
        if len(found) == 1:
            return found[0]
        if found:
            raise InputError("joint_not_unique", format=self.what, joint=name, count=len(found))
        known = [each.attributes["name"] for each in candidates if "name" in each.attributes]
        if not known:
            raise InputError("no_joints", format=self.what, hint=hint)
        raise InputError(
            "unknown_joint", format=self.what, joint=name, choices=choices(name, known)
        )

    def set_attributes(self, element: Element, values: Mapping[str, str]) -> list[Edit]:
        """Return the edits that give attributes of a start tag these values."""
        edits: list[Edit] = []
        present: dict[str, re.Match[bytes]] = {}
        at = element.start + 1 + len(element.tag.encode())
        while match := _ATTRIBUTE.match(self.content, at, element.opened):
            present[match[1].decode("utf-8", "surrogateescape")] = match
            at = match.end()
        added = b""
        for name, value in values.items():
            quoted = attribute(value)
            if name in present:
                start, end = present[name].span(2)
                edits.append(Edit(start=start, end=end, content=quoted))
            else:
                added += b" " + name.encode() + b"=" + quoted
        if added:
            edits.append(Edit(start=at, end=at, content=added))
        return edits

    def inner(self, element: Element) -> str:
        """Return what stands between the tags of an element, without white space around it."""
        return self.content[element.opened : element.closing].decode("utf-8", "replace").strip()

    def comment(self, sentences: Sequence[str], indent: bytes) -> bytes:
        """Return a comment of some sentences, over several lines."""
        lines = [MARK + sentences[0], *sentences[1:]]
        # Two hyphens would end the comment, and a hyphen at its end would too.
        safe = [re.sub("-(?=-)", "- ", line).encode("ascii", "xmlcharrefreplace") for line in lines]
        return b"<!-- " + (self.newline + indent + b"     ").join(safe) + b" -->"

    def indent(self, element: Element) -> bytes:
        """Return the white space before an element on its line."""
        begin = self.content.rfind(b"\n", 0, element.start) + 1
        before = self.content[begin : element.start]
        return before[: len(before) - len(before.lstrip())]

    def child_indent(self, parent: Element) -> bytes:
        """Return the white space before a new child of an element."""
        siblings = [each for each in parent.children if self._begins_line(each)]
        return self.indent(siblings[-1]) if siblings else self.indent(parent) + b"  "

    def insert_child(self, parent: Element, lines: Sequence[bytes]) -> list[Edit]:
        """Return the edits that put lines at the end of an element, indented as its children."""
        outer, inner = self.indent(parent), self.child_indent(parent)
        body = b"".join(self.newline + inner + line for line in lines)
        if parent.closing == parent.end:  # <joint .../>
            start = parent.opened - 2
            while self.content[start - 1 : start].isspace():
                start -= 1
            tail = self.newline + outer + f"</{parent.tag}>".encode()
            return [Edit(start=start, end=parent.end, content=b">" + body + tail)]
        at = parent.children[-1].end if parent.children else parent.opened
        text = self.content[at : parent.closing]
        if text.strip():  # text between the last child and the end tag
            at = at + len(text.rstrip())
        if b"\n" not in self.content[at : parent.closing]:
            body += self.newline + outer
        return [Edit(start=at, end=at, content=body)]

    def _begins_line(self, element: Element) -> bool:
        begin = self.content.rfind(b"\n", 0, element.start) + 1
        return not self.content[begin : element.start].strip()

    def insert_before(self, element: Element, content: bytes) -> list[Edit]:
        """Return the edits that put something on a line of its own before an element.

        A comment of an earlier export that stands there is replaced.
        """
        siblings = [] if element.parent is None else element.parent.children
        place = next(k for k, each in enumerate(siblings) if each is element)
        before = siblings[place - 1] if place else None
        if before is not None and before.tag == "#comment" and is_mark(before):
            return [Edit(start=before.start, end=before.end, content=content)]
        tail = self.newline + self.indent(element) if self._begins_line(element) else b""
        return [Edit(start=element.start, end=element.start, content=content + tail)]

    def replace(self, element: Element, content: bytes | None) -> Edit:
        """Return the edit that replaces an element, or removes it and the white space before it."""
        start = element.start
        if content is None:
            start = len(self.content[:start].rstrip())
        return Edit(start=start, end=element.end, content=content or b"")

    def edited(self, edits: Sequence[Edit]) -> bytes:
        """Return the text with edits, none of which overlap."""
        content = self.content
        for edit in sorted(edits, key=lambda each: each.start, reverse=True):
            content = content[: edit.start] + edit.content + content[edit.end :]
        return content


def attribute(value: str) -> bytes:
    """Return a quoted attribute value in ASCII, which every encoding that is edited contains."""
    escaped = escape(value, {'"': "&quot;", "\n": "&#10;", "\t": "&#9;"})
    return b'"' + escaped.encode("ascii", "xmlcharrefreplace") + b'"'


def is_mark(comment: Element) -> bool:
    """Return whether a comment was written by an export."""
    return comment.text.strip().startswith(MARK.strip())
