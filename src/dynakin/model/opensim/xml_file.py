"""XML as nodes that know their line, so that every error can name its place in the file."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import NoReturn
from xml.parsers import expat

from dynakin.errors import ModelError
from dynakin.files import LARGEST_TEXT, read_bytes

_DEEPEST = 100  # elements in one another; OpenSim's own files have 15


@dataclass(eq=False)
class Node:
    """An element; ``path`` is the file, for messages."""

    tag: str
    name: str
    line: int
    path: Path
    children: list[Node] = field(default_factory=list)
    text: str = ""

    def __iter__(self) -> Iterator[Node]:
        return iter(self.children)

    @property
    def where(self) -> str:
        """'file.osim, line 12: PinJoint "knee"'."""
        return f"{self.path}, line {self.line}: {self.tag}" + (f' "{self.name}"' if self.name else "")

    def fail(self, message: str) -> NoReturn:
        """Raise a ModelError at this place."""
        raise ModelError(f"{self.where}: {message}")

    def find(self, *tags: str) -> Node | None:
        """The descendant along these tags, or None."""
        node: Node | None = self
        for tag in tags:
            node = next((child for child in node.children if child.tag == tag), None) if node else None
        return node

    def need(self, *tags: str) -> Node:
        """The descendant along these tags; refused where it is missing."""
        found = self.find(*tags)
        return found if found is not None else self.fail(f"expected an element {'/'.join(tags)}")

    def walk(self) -> Iterator[Node]:
        """This node and all below it, in the order of the file."""
        yield self
        for child in self.children:
            yield from child.walk()

    def objects(self, name: str) -> list[Node]:
        """Members of a set (``<name><objects>...``); empty where the file has none."""
        found = self.find(name, "objects")
        return [] if found is None else found.children

    def word(self, tag: str) -> str:
        """Text of a child, "" without one."""
        child = self.find(tag)
        return "" if child is None else child.text.strip()

    def numbers(self, tag: str, count: int | None = None, otherwise: tuple[float, ...] | None = None) -> list[float]:
        """Numbers of a child, ``count`` of them where given."""
        child = self.find(tag)
        if child is None:
            return list(otherwise) if otherwise is not None else self.fail(f"expected an element {tag}")
        try:
            found = [float(word) for word in child.text.replace(",", " ").split()]
        except ValueError:
            child.fail(f"found {child.text.strip()[:60]!r}, expected numbers")
        if count is not None and len(found) != count:
            child.fail(f"found {len(found)} numbers, expected {count}")
        if not all(abs(value) < float("inf") for value in found):
            child.fail(f"found {child.text.strip()[:60]!r}, expected finite numbers")
        return found

    def number(self, tag: str, otherwise: float | None = None) -> float:
        """One number of a child."""
        return self.numbers(tag, 1, None if otherwise is None else (otherwise,))[0]

    def flag(self, tag: str, otherwise: bool = False) -> bool:
        """true or false of a child."""
        text = self.word(tag).casefold()
        if text not in ("", "true", "false"):
            self.need(tag).fail(f"found {text!r}, expected true or false")
        return otherwise if text == "" else text == "true"


def read_xml(path: Path) -> Node:
    """The root element of an XML file.

    Raises:
        ModelError: the file cannot be read, or is no (whole) XML file; with the line.
    """
    content = read_bytes(path, ModelError, LARGEST_TEXT)
    parser = expat.ParserCreate()
    parser.buffer_text = True
    top = Node("", "", 0, path)
    stack = [top]

    def start(tag: str, attributes: dict[str, str]) -> None:
        named = attributes.get("name", "") or attributes.get("Version", "")
        node = Node(tag, named, parser.CurrentLineNumber, path)
        if len(stack) > _DEEPEST:
            node.fail(f"found more than {_DEEPEST} elements in one another, expected fewer")
        stack[-1].children.append(node)
        stack.append(node)

    def text(data: str) -> None:
        stack[-1].text += data

    parser.StartElementHandler = start
    parser.EndElementHandler = lambda tag: stack.pop() and None
    parser.CharacterDataHandler = text
    try:
        parser.Parse(content, True)
    except expat.ExpatError as error:
        message = expat.errors.messages[error.code]
        raise ModelError(f"{path}, line {error.lineno}: not a whole XML file: {message}") from None
    except (LookupError, ValueError) as error:  # Python's codecs, asked by the parser
        raise ModelError(f"{path}: its encoding cannot be read ({error}), expected UTF-8") from None
    return top.children[0]
