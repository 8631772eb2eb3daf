# SPDX-License-Identifier: MIT
"""`--search`: trees and models in files that the tree's own file does not include.

What is searched is a folder with all that lies below it, a Groot2 project (.btproj) with the files that it includes, or
one file. Of several files that have a tree or a node the nearest one is taken: the file that asks, its folder, then by
the steps from folder to folder. Two that are as near must say the same.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from canopy.compiler.errors import CompileError, Place
from canopy.compiler.leaf_model import MODEL_TAGS, Declarations, read_model
from canopy.compiler.port_types import Options
from canopy.compiler.xml_reader import Element, parse_xml
from canopy.files import FileError, read_bytes
from canopy.tree.built_in import CANOPY_ONLY
from canopy.tree.node_id import id_of

if TYPE_CHECKING:
    from canopy.compiler.documents import Documents

MOST_FILES = 10_000
ENDINGS = (".xml", ".btproj")


@dataclass
class _Source:
    """A file that was looked into."""

    path: Path
    models: list[Element] = field(default_factory=list)


def _below(folder: Path) -> Iterator[Path]:
    """The tree files of a folder in a fixed order; folders that are links, or hidden, are not looked into."""
    for top, folders, names in os.walk(folder):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        yield from (Path(top) / name for name in sorted(names) if name.endswith(ENDINGS))


def _steps(one: Path, other: Path) -> int:
    """How many folders to leave and to enter from one file to the other; -1 for the same file."""
    if one == other:
        return -1
    here, there = one.parent.parts, other.parent.parts
    common = 0
    for a, b in zip(here, there, strict=False):
        if a != b:
            break
        common += 1
    return len(here) + len(there) - 2 * common


def _same(one: Element, other: Element) -> bool:
    waiting = [(one, other)]
    while waiting:
        a, b = waiting.pop()
        if a.tag != b.tag or a.attributes != b.attributes or len(a.children) != len(b.children):
            return False
        waiting.extend(zip(a.children, b.children, strict=True))
    return True


class Library:
    """What the searched files hold, by ID. They are read when the first name is missed."""

    def __init__(self, options: Options | None = None, built_in: frozenset[str] = frozenset()) -> None:
        self._options = options or Options()
        self._built_in = built_in
        self._sources: dict[str, _Source] = {}
        self._trees: dict[str, list[Element]] = {}
        self._models: dict[str, list[Element]] = {}
        self._ports: dict[str, list[Element]] = {}
        self._is_read = not self._options.search
        self._taken: set[str] = set()

    # Reading

    def _read_all(self) -> None:
        if self._is_read:
            return
        self._is_read = True
        for place in self._options.search:
            if place.is_dir():
                for file in _below(place):
                    self._read(file, named=False)
            else:
                self._read(place, named=True)

    def _read(self, file: Path, *, named: bool) -> None:
        """Reads a file, and what a project includes. Files that were not named and hold no trees are passed over."""
        waiting = [file]
        while waiting:
            path = waiting.pop()
            key = os.path.realpath(path)
            if key in self._sources:
                continue
            if len(self._sources) >= MOST_FILES:
                raise CompileError(Place("--search"), f"more than {MOST_FILES} files", "name a narrower folder")
            self._sources[key] = source = _Source(path)
            try:
                root = parse_xml(read_bytes(path), str(path))
            except (FileError, CompileError) as error:
                if named and path == file:
                    problem = error.problem if isinstance(error, FileError) else error.message
                    raise CompileError(Place(f"--search {path}"), problem) from error
                continue
            if root.tag != "root" or root.attributes.get("BTCPP_format") != "4":
                continue
            for element in root.children:
                self._add(element, source, named)
                if element.tag == "include" and "path" in element.attributes and (named or path.suffix == ".btproj"):
                    waiting.append(path.parent / element.attributes["path"])

    def _add(self, element: Element, source: _Source, named: bool) -> None:
        if element.tag == "BehaviorTree" and "ID" in element.attributes:
            self._trees.setdefault(element.attributes["ID"], []).append(element)
        elif element.tag == "TreeNodesModel":
            source.models.append(element)
            for model in element.children:
                if model.tag == "SubTree" and named:
                    self._ports.setdefault(model.attributes.get("ID", ""), []).append(model)
                elif model.tag in MODEL_TAGS and model.tag != "SubTree":
                    self._models.setdefault(model.attributes.get("ID", ""), []).append(model)

    # Asking

    @staticmethod
    def _nearest(candidates: list[Element], asking: Element) -> list[Element]:
        here = Path(os.path.realpath(asking.place.file))
        steps = [_steps(here, Path(os.path.realpath(element.place.file))) for element in candidates]
        return [element for element, far in zip(candidates, steps, strict=True) if far == min(steps)]

    def add_tree(self, tree_id: str, asking: Element, documents: Documents) -> bool:
        """Adds the tree of that name, with all models of its file. False: no file has it.

        Raises:
            CompileError: several do, and differ; or its file contradicts what is declared.
        """
        self._read_all()
        candidates = self._nearest(self._trees.get(tree_id, []), asking)
        if not candidates:
            return False
        first = candidates[0]
        for other in candidates[1:]:
            if not _same(first, other):
                raise CompileError(
                    asking.attribute_place("ID"),
                    f"tree '{tree_id}' is in two files that are searched, and differs: {first.place} and {other.place}",
                    "name a narrower folder, or include the right file",
                )
        if len(first.children) != 1:
            raise CompileError(first.place, f"<BehaviorTree ID='{tree_id}'> needs exactly 1 node")
        documents.trees[tree_id] = first
        self._took(first, documents)
        if first.place.file not in self._taken:
            self._taken.add(first.place.file)
            for model in self._sources[os.path.realpath(first.place.file)].models:
                read_model(model, documents.declarations, self._options, self._built_in, documents.foreign)
        return True

    @staticmethod
    def _took(element: Element, documents: Documents) -> None:
        path = Path(element.place.file)
        if path not in documents.files:
            documents.files.append(path)

    def add_ports(self, tree_id: str, asking: Element, documents: Documents) -> None:
        """Adds ports of a tree that its files do not declare, from a file that --search names itself.

        Other files may have another tree of that name.

        Raises:
            CompileError: a declaration is wrong.
        """
        self._read_all()
        if tree_id not in self._ports:
            return
        candidates = self._nearest(self._ports.pop(tree_id), asking)
        found = Declarations()
        model = Element("TreeNodesModel", {}, candidates[0].place, [candidates[0]])
        read_model(model, found, self._options, self._built_in, documents.foreign)
        declared = documents.declarations.subtrees.get(tree_id, ())
        names = {port.name for port in declared}
        more = tuple(port for port in found.subtrees[tree_id] if port.name not in names)
        documents.declarations.subtrees[tree_id] = (*declared, *more)
        self._took(candidates[0], documents)

    def add_model(self, node_id: str, asking: Element, documents: Documents) -> None:
        """Adds the declaration of that node, where it has none and a file that is searched has one.

        Raises:
            CompileError: two do, and differ.
        """
        if node_id in documents.declarations.leaves:
            return
        self._read_all()
        candidates = self._nearest(self._models.get(node_id, []), asking)
        if not candidates:
            return
        found = Declarations()
        found.enums = documents.declarations.enums
        for element in candidates:
            model = Element("TreeNodesModel", {}, element.place, [element])
            try:
                read_model(model, found, self._options, self._built_in, documents.foreign)
            except CompileError as error:
                if error.message.startswith(f"'{node_id}' is declared again"):
                    raise CompileError(
                        asking.place,
                        f"node '{node_id}' is declared in two files that are searched, and differs: "
                        f"{candidates[0].place} and {element.place}",
                        "declare it in the tree's own file, or name a narrower folder",
                    ) from error
                raise
        model = Element("TreeNodesModel", {}, candidates[0].place, [candidates[0]])
        read_model(model, documents.declarations, self._options, self._built_in, documents.foreign)
        self._took(candidates[0], documents)


def complete(documents: Documents, built_in: frozenset[str], start: str | None = None) -> None:
    """Adds what the trees use and other files have, as far as they are searched. `start`: only what this tree uses.

    Raises:
        CompileError: several files have it, and differ.
    """
    waiting = list(documents.trees.values()) if start is None else [documents.trees[start]]
    seen = set(documents.trees) if start is None else {start}
    while waiting:
        element = waiting.pop()
        waiting.extend(element.children)
        name = id_of(element)
        if element.tag == "SubTree":
            tree_id = element.attributes.get("ID", "")
            if tree_id not in documents.trees:
                documents.library.add_tree(tree_id, element, documents)
            if tree_id in documents.trees and tree_id not in seen:
                seen.add(tree_id)
                waiting.append(documents.trees[tree_id])
        elif name and (name not in built_in or name in CANOPY_ONLY):
            documents.library.add_model(name, element, documents)
    for tree_id in list(documents.trees) if start is None else sorted(seen):
        documents.library.add_ports(tree_id, documents.trees[tree_id], documents)
