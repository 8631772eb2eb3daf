# SPDX-License-Identifier: MIT
"""A tree file and the files it includes: the trees by ID, which one is the main tree, and what the models declare."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from canopy.compiler.errors import CompileError, Place, nearest
from canopy.compiler.leaf_model import Declarations, Leaf, read_model
from canopy.compiler.port_types import Options
from canopy.compiler.xml_reader import Element, parse_xml
from canopy.files import FileError, read_bytes
from canopy.tree.foreign import Foreign
from canopy.tree.search import Library

MOST_TREES = 20
UNNAMED = "BehaviorTree"
ROOT_CHILDREN = ("BehaviorTree", "TreeNodesModel", "include")
# Attributes that any node and tree may have and that change nothing in a tick.
PLAIN_ATTRIBUTES = ("name", "_uid", "_description", "_fullpath", "_trace")


@dataclass
class Documents:
    """All files of an application. `files` is in the order of reading, the main file first."""

    files: list[Path] = field(default_factory=list)
    trees: dict[str, Element] = field(default_factory=dict)
    main: str = ""
    top: Element | None = None
    problems: int = 0
    """How many errors were left out, where the trees are only drawn."""
    declarations: Declarations = field(default_factory=Declarations)
    foreign: Foreign = field(default_factory=Foreign)
    library: Library = field(default_factory=Library)

    @cached_property
    def usable_leaves(self) -> dict[str, Leaf]:
        """The leaves that a tree can use, by ID."""
        return {name: leaf for name, leaf in self.declarations.leaves.items() if leaf.problem is None}


class _Reader:
    def __init__(self, options: Options, built_in: frozenset[str]) -> None:
        self._options = options
        self._built_in = built_in
        self.documents = Documents(foreign=Foreign(options.foreign), library=Library(options, built_in))

    def read(self, path: Path) -> Element:
        """Reads a file and, depth first, what it includes. The files that are open are in `chain`."""
        top = self._read_root(path)
        waiting = [(iter(top.children), path)]
        known = {path.resolve()}
        chain = dict.fromkeys(known)
        while waiting:
            elements, file = waiting[-1]
            element = next(elements, None)
            if element is None:
                waiting.pop()
                chain.popitem()
            elif element.tag == "include":
                try:
                    path = self._included(element, file)
                except CompileError as error:
                    self._wrong(error)
                    continue
                target = path.resolve()
                if target in chain and self._options.draw:
                    continue
                if target in chain:
                    names = " -> ".join(open_file.name for open_file in (*chain, target))
                    raise CompileError(element.place, f"files include each other in a loop: {names}")
                if target not in known:
                    known.add(target)
                    try:
                        inner = self._read_root(path, element)
                    except CompileError as error:
                        self._wrong(error)
                        continue
                    waiting.append((iter(inner.children), path))
                    chain[target] = None
            else:
                try:
                    self._take(element)
                except CompileError as error:
                    self._wrong(error)
        return top

    def _wrong(self, error: CompileError) -> None:
        """Raises it; where trees are only drawn, counts it."""
        if not self._options.draw:
            raise error
        self.documents.problems += 1

    def _read_root(self, path: Path, included_by: Element | None = None) -> Element:
        try:
            data = read_bytes(path)
        except FileError as error:
            if included_by is None:
                raise CompileError(Place(str(path)), error.problem) from error
            place = included_by.attribute_place("path")
            message = f"the included file '{path}' {'is not there' if error.missing else error.problem}"
            raise CompileError(place, message, "paths are relative to this file") from error
        self.documents.files.append(path)
        root = parse_xml(data, str(path))
        # An included file that does not say its format has that of the file that includes it.
        version = root.attributes.get("BTCPP_format", "4" if included_by is not None else "")
        is_tree_file = root.tag == "root" and (self._options.draw or version == "4")
        if not is_tree_file:
            raise CompileError(
                root.place,
                'the outer element must be <root BTCPP_format="4">',
                "a file without it may be one of BehaviorTree.CPP 3: canopy fmt --to-4 converts it",
            )
        if not self._options.draw:
            root.only(self.documents.foreign, "BTCPP_format", "main_tree_to_execute", "project_name")
        return root

    def _included(self, element: Element, file: Path) -> Path:
        element.only(self.documents.foreign, "path", "ros_pkg")
        if not element.attributes.get("path"):
            raise CompileError(element.place, "<include> needs the attribute path", 'for example path="other.xml"')
        return self._folder(element, file) / element.attributes["path"]

    def _folder(self, element: Element, file: Path) -> Path:
        """What an included path is relative to."""
        package = element.attributes.get("ros_pkg")
        if package is None:
            return file.parent
        folders = self._options.ros_packages
        if package not in folders:
            raise CompileError(
                element.attribute_place("ros_pkg"),
                f"<include ros_pkg='{package}'>: the folder of this package is not known",
                f"say where it is: --ros-package {package}=DIR" + (f"; {nearest(package, folders)}" if folders else ""),
            )
        return folders[package]

    def _take(self, element: Element) -> None:
        if element.tag == "BehaviorTree":
            element.only(self.documents.foreign, "ID", "description", *PLAIN_ATTRIBUTES)
            # BehaviorTree.CPP accepts a lone tree without an ID; two of them meet here.
            tree_id = element.attributes.get("ID") or UNNAMED
            if tree_id in self.documents.trees:
                first = f"the other one: {self.documents.trees[tree_id].place}"
                raise CompileError(element.place, f"<BehaviorTree> needs an ID of its own, not '{tree_id}'", first)
            if len(element.children) != 1 and not (self._options.draw and element.children):
                raise CompileError(
                    element.place,
                    f"<BehaviorTree ID='{tree_id}'> needs exactly 1 node, and has {len(element.children)}",
                )
            self.documents.trees[tree_id] = element
        elif element.tag == "TreeNodesModel":
            read_model(element, self.documents.declarations, self._options, self._built_in, self.documents.foreign)
        else:
            raise CompileError(
                element.place, f"<{element.tag}> is not supported here", nearest(element.tag, ROOT_CHILDREN)
            )


def _choose_tree(root: Element, trees: dict[str, Element], asked: str | None, draw: bool) -> str:
    if asked is not None:
        if asked not in trees:
            raise CompileError(
                Place("--main-tree"), f"'{asked}' is no tree of {root.place.file}", nearest(asked, trees)
            )
        return asked
    wanted = root.attributes.get("main_tree_to_execute")
    if wanted is not None and (wanted in trees or not draw):
        if wanted not in trees:
            raise CompileError(
                root.attribute_place("main_tree_to_execute"),
                f"main_tree_to_execute='{wanted}' is not a tree of this file or of those it includes",
                nearest(wanted, trees),
            )
        return wanted
    own = [tree_id for tree_id, element in trees.items() if element.place.file == root.place.file]
    for candidates in (own, list(trees)):
        if len(candidates) == 1:
            return candidates[0]
    if draw:
        return roots(own or list(trees), trees)[0]
    raise CompileError(root.place, "several trees, and no main_tree_to_execute says which", main_tree_list(own, trees))


def roots(names: list[str], trees: dict[str, Element]) -> list[str]:
    """Those of the trees that no other one has as a SubTree; all, if there are none."""
    waiting = [trees[name] for name in names]
    inner = set()
    while waiting:
        element = waiting.pop()
        waiting.extend(element.children)
        if element.tag == "SubTree":
            inner.add(element.attributes.get("ID"))
    return [name for name in names if name not in inner] or names


def main_tree_list(own: list[str], trees: dict[str, Element]) -> str:
    """A help text that lists the trees which the main one can be: first those that are no part of another."""
    names = own or list(trees)
    first = roots(names, trees)
    shown = [f"--main-tree {name} (line {trees[name].place.line})" for name in first[:MOST_TREES]]
    more = f" and {len(first) - MOST_TREES} more" if len(first) > MOST_TREES else ""
    parts = f"; {len(names) - len(first)} more are parts of these" if len(names) > len(first) else ""
    return f"say it there, or choose one: {', '.join(shown)}{more}{parts}"


def read_files(path: Path, options: Options, built_in: frozenset[str]) -> Documents:
    """Reads a file and all that it includes. It may hold no tree, or several without a main one.

    Raises:
        CompileError: a file cannot be read, is no tree file, or includes itself.
    """
    reader = _Reader(options, built_in)
    reader.documents.top = reader.read(path)
    return reader.documents


def read_documents(path: Path, options: Options, built_in: frozenset[str]) -> Documents:
    """Reads a tree file and all that it includes, and chooses the main tree.

    Raises:
        CompileError: a file cannot be read, is no tree file, or includes itself, or no tree is the main one.
    """
    documents = read_files(path, options, built_in)
    assert documents.top is not None
    if not documents.trees:
        raise CompileError(Place(documents.top.place.file, 1, 1), "no <BehaviorTree> in this file")
    documents.main = _choose_tree(documents.top, documents.trees, options.main_tree, options.draw)
    return documents
