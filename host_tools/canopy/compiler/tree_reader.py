# SPDX-License-Identifier: MIT
"""XML elements into a tree of nodes, checked: every node is known, has the right children and the right attributes."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from canopy.compiler.errors import CompileError, Place, nearest
from canopy.compiler.leaf_model import Leaf, read_leaves
from canopy.compiler.node_types import NodeType, Parameter, node_types
from canopy.compiler.xml_reader import Element, read_xml

MAX_NODES = 65_534

# Attributes that any node may have and that change nothing in a tick.
PLAIN_ATTRIBUTES = ("name", "_uid", "_description")

# Kinds of the user's own leaves: their names in XML are those of the leaves.
USER_KINDS = ("Condition", "SyncAction", "StatefulAction")

# Rows of nodes.def that are made by the compiler, and are no names in XML.
INTERNAL = ("Attributes", "Loop", "Switch", "Control", "Decorator")

# Of BehaviorTree.CPP 4, and known to be missing here: refused by name, not as a typing error.
NOT_SUPPORTED = frozenset(
    "SubTree Switch2 Switch3 Switch4 Switch5 Switch6 LoopInt LoopBool LoopDouble LoopString Precondition "
    "SkipUnlessUpdated WaitValueUpdate WasEntryUpdated Script ScriptCondition SetBlackboard UnsetBlackboard TestNode "
    "ManualSelector".split()
)
CONDITION_ATTRIBUTES = frozenset(
    "_failureIf _successIf _skipIf _while _onSuccess _onFailure _onHalted _post _autoremap".split()
)


@dataclass
class Node:
    """A node of the tree. Leaves have `leaf` and `port_values` (C literals in the order of leaf.ports)."""

    type: NodeType
    name: str
    place: Place
    parameters: tuple[int, ...] = ()
    leaf: Leaf | None = None
    port_values: tuple[str, ...] = ()
    children: list[Node] = field(default_factory=list)


@dataclass(frozen=True)
class Tree:
    """A checked tree: its ID, the file it came from, the root, and the leaves that the file declares."""

    id: str
    path: Path
    root: Node
    leaves: dict[str, Leaf]


# Least value of a parameter; the others may be any 32-bit number.
LEAST = {"num_attempts": -1, "num_cycles": -1, "msec": 0, "delay_msec": 0, "then_skip": 0}
# Parameters that are a number of children: 1 to N, or -1 (all) down to -N.
THRESHOLDS = ("success_count", "failure_count", "max_failures")


def _parameter(element: Element, parameter: Parameter) -> int:
    name = parameter.name
    text = element.attributes.get(name, parameter.default)
    if not text:
        raise CompileError(element.place, f"<{element.tag}> needs the attribute {name}", f'for example {name}="3"')
    if text.startswith("{"):
        raise CompileError(
            element.place, f"{name}: blackboard entries ({text}) are not supported", "give a literal value"
        )
    if text in ("true", "false"):
        text = "1" if text == "true" else "0"
    try:
        value = int(text)
    except ValueError:
        raise CompileError(element.place, f"{name}='{text}' is not a whole number") from None
    least = LEAST.get(name, -(2**31))
    if not least <= value < 2**31:
        raise CompileError(element.place, f"{name}={value} is outside [{least}, {2**31 - 1}]")
    count = len(element.children)
    if name in THRESHOLDS and not (1 <= value <= count or -count <= value <= -1):
        raise CompileError(
            element.place,
            f"{name}={value} can never be met by {count} children, or needs none",
            f"1 to {count}, or -1 (all) down to -{count}",
        )
    return value


def _check_attributes(element: Element, allowed: set[str]) -> None:
    for attribute in element.attributes:
        if attribute in CONDITION_ATTRIBUTES:
            raise CompileError(element.place, f"the attribute {attribute} is not supported", "use nodes instead")
        if attribute == "catch_on_halt" and element.tag == "TryCatch":
            if element.attributes[attribute] != "false":
                raise CompileError(element.place, "catch_on_halt is not supported", "give the last child's work to a halt handler")
        elif attribute not in allowed:
            raise CompileError(element.place, f"<{element.tag}> has no attribute '{attribute}'", nearest(attribute, allowed))


def _leaf_node(element: Element, leaf: Leaf, *, explicit: bool) -> Node:
    allowed = {*PLAIN_ATTRIBUTES, *(port.name for port in leaf.ports)} | ({"ID"} if explicit else set())
    _check_attributes(element, allowed)
    values = []
    for port in leaf.ports:
        text = element.attributes.get(port.name, port.default)
        if text is None:
            raise CompileError(element.place, f"'{leaf.id}' needs a value for its port '{port.name}'")
        values.append(port.literal(text, element.place))
    if element.children:
        raise CompileError(element.children[0].place, f"'{leaf.id}' is a leaf and cannot have children")
    name = element.attributes.get("name", leaf.id)
    return Node(node_types()[leaf.kind], name, element.place, leaf=leaf, port_values=tuple(values))


def _built_in_node(element: Element, kind: NodeType) -> Node:
    _check_attributes(element, {*PLAIN_ATTRIBUTES, *(parameter.name for parameter in kind.parameters)})
    count = len(element.children)
    if not kind.least_children <= count <= kind.most_children:
        raise CompileError(element.place, f"<{kind.name}> needs {kind.arity_text()} child node(s), and has {count}")
    parameters = tuple(_parameter(element, parameter) for parameter in kind.parameters)
    return Node(kind, element.attributes.get("name", kind.name), element.place, parameters)


def built_in_types() -> dict[str, NodeType]:
    """The node types that XML can name."""
    hidden = {*USER_KINDS, *INTERNAL, *NOT_SUPPORTED}
    return {name: kind for name, kind in node_types().items() if name not in hidden}


def _make_node(element: Element, leaves: dict[str, Leaf]) -> Node:
    built_in = built_in_types()
    if element.tag in built_in:
        return _built_in_node(element, built_in[element.tag])
    if element.tag in ("Action", "Condition"):
        leaf_id, explicit = element.attributes.get("ID", ""), True
    else:
        leaf_id, explicit = element.tag, False
    if leaf_id in leaves:
        leaf = leaves[leaf_id]
        if explicit and (element.tag == "Condition") != (leaf.kind == "Condition"):
            raise CompileError(element.place, f"'{leaf_id}' is declared as {leaf.kind}, at {leaf.place}")
        return _leaf_node(element, leaf, explicit=explicit)
    if leaf_id in NOT_SUPPORTED:
        raise CompileError(element.place, f"<{leaf_id}> is not supported yet", f"supported: {', '.join(built_in)}")
    raise CompileError(element.place, f"unknown node '{leaf_id}'", nearest(leaf_id, [*leaves, *built_in]))


def _build(top: Element, leaves: dict[str, Leaf]) -> Node:
    """The tree below one element. A loop, not recursion: trees may be as deep as they are large."""
    root = _make_node(top, leaves)
    waiting = [(top, root)]
    count = 1
    while waiting:
        element, node = waiting.pop()
        for child_element in element.children:
            count += 1
            if count > MAX_NODES:
                raise CompileError(child_element.place, f"the tree has more than {MAX_NODES} nodes")
            child = _make_node(child_element, leaves)
            node.children.append(child)
            if node.leaf is None:
                waiting.append((child_element, child))
    return root


def _choose_tree(root: Element, trees: dict[str, Element]) -> str:
    wanted = root.attributes.get("main_tree_to_execute")
    if wanted is None:
        if len(trees) == 1:
            return next(iter(trees))
        raise CompileError(root.place, "several trees, and no main_tree_to_execute says which", nearest("", trees))
    if wanted not in trees:
        raise CompileError(root.place, f"main_tree_to_execute='{wanted}' is not a tree of this file", nearest(wanted, trees))
    return wanted


def read_tree(path: Path) -> Tree:
    """The main tree of an XML file in BehaviorTree.CPP's format 4.

    Raises:
        CompileError: anything in the file that cannot be compiled.
    """
    root = read_xml(path)
    if root.tag != "root" or root.attributes.get("BTCPP_format") != "4":
        raise CompileError(root.place, 'the outer element must be <root BTCPP_format="4">')
    trees: dict[str, Element] = {}
    leaves: dict[str, Leaf] = {}
    for element in root.children:
        if element.tag == "BehaviorTree":
            tree_id = element.attributes.get("ID", "")
            if not tree_id or tree_id in trees:
                raise CompileError(element.place, f"<BehaviorTree> needs an ID of its own, not '{tree_id}'")
            trees[tree_id] = element
        elif element.tag == "TreeNodesModel":
            leaves |= read_leaves(element)
            for leaf in leaves.values():
                if leaf.id in built_in_types() or leaf.id in NOT_SUPPORTED:
                    raise CompileError(leaf.place, f"'{leaf.id}' is the name of a built-in node", "choose another ID")
        else:
            allowed = ("BehaviorTree", "TreeNodesModel")
            raise CompileError(element.place, f"<{element.tag}> is not supported here", nearest(element.tag, allowed))
    if not trees:
        raise CompileError(root.place, "no <BehaviorTree> in this file")
    tree_id = _choose_tree(root, trees)
    top = trees[tree_id]
    if len(top.children) != 1:
        raise CompileError(top.place, f"<BehaviorTree ID='{tree_id}'> needs exactly 1 node, and has {len(top.children)}")
    return Tree(tree_id, path, _build(top.children[0], leaves), leaves)
