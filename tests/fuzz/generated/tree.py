# SPDX-License-Identifier: MIT
"""Small random trees that use every kind of node, leaf, port and script, with hostile texts and numbers in them."""

from __future__ import annotations

import random
from collections.abc import Callable
from xml.sax.saxutils import quoteattr

from fuzz.generated.hostile import Hostile

MAX_NODES = 14
_CONTROLS = ["Sequence", "ReactiveSequence", "Fallback", "ReactiveFallback", "AsyncSequence", "SequenceWithMemory"]
_PLAIN = ["Inverter", "ForceSuccess", "ForceFailure", "KeepRunningUntilFailure", "RunOnce"]
_NUMBERED = {"Repeat": "num_cycles", "RetryUntilSuccessful": "num_attempts", "Delay": "delay_msec", "Timeout": "msec"}
_THRESHOLDS = {"Parallel": "success_count", "ParallelAll": "max_failures", "ReactiveParallel": "success_count"}
_TYPES = [
    "int8_t",
    "uint8_t",
    "int16_t",
    "int32_t",
    "uint32_t",
    "int64_t",
    "uint64_t",
    "bool",
    "duration",
    "int16_t*0.01",
]
_TEXT_TYPES = ["std::string"]
_FLOAT_TYPES = ["float", "double"]
_ENTRIES = ["alpha", "beta", "gamma"]
_OPERATORS = ["+", "-", "*", "&", "|", "^"]
_COMPARISONS = ["<", "<=", ">", ">=", "==", "!="]


def _attributes(**values: str) -> str:
    # A line break in an attribute must be written as a reference, or a parser makes a blank of it.
    escapes = {"\n": "&#10;", "\r": "&#13;", "\t": "&#9;"}
    return "".join(f" {name}={quoteattr(value, escapes)}" for name, value in values.items())


class TreeMaker:
    """One tree file. `inputs` and `outputs` are the names of signals that leaves and scripts may use."""

    def __init__(self, rng: random.Random, hostile: Hostile, inputs: list[str], outputs: list[str]) -> None:
        self._rng = rng
        self._hostile = hostile
        self._inputs = inputs
        self._outputs = outputs
        self._nodes = 0
        self.floats = rng.random() < 0.5
        self._leaves = [self._leaf(number) for number in range(rng.randint(1, 3))]

    def xml(self) -> str:
        """The whole file."""
        rng, hostile = self._rng, self._hostile
        main = hostile.text("Main")
        trees = [(main, self._node(0))]
        if rng.random() < 0.3:
            other = hostile.text("Other")
            trees.append((other, "<AlwaysSuccess/>"))
            trees[0] = (main, f"<Sequence><SubTree{_attributes(ID=other, x=self._value())}/>{trees[0][1]}</Sequence>")
        bodies = "\n".join(f"<BehaviorTree{_attributes(ID=name)}>{body}</BehaviorTree>" for name, body in trees)
        models = "".join(model for _, _, model in self._leaves)
        subtree = "".join(
            f'<inout_port name="{name}" type="{kind}" default="{hostile.integer(1)}"/>'
            for name, kind in zip(_ENTRIES, ("int32_t", "int64_t", "uint8_t"), strict=True)
        )
        models += f"<SubTree{_attributes(ID=main)}>{subtree}</SubTree>"
        top = _attributes(BTCPP_format="4", main_tree_to_execute=main)
        return f"<root{top}>\n{bodies}\n<TreeNodesModel>{models}</TreeNodesModel></root>\n"

    def _leaf(self, number: int) -> tuple[str, list[tuple[str, str]], str]:
        """(ID, the ports that have to be given, the model)."""
        rng, hostile = self._rng, self._hostile
        kind = rng.choice(["Condition", "SyncAction", "StatefulAction"])
        name = hostile.text(f"Leaf{number}", 0.1)
        types = _TYPES + _TEXT_TYPES * 2 + (_FLOAT_TYPES * 3 if self.floats else [])
        ports, model = [], ""
        for place in range(rng.randint(0, 3)):
            port_type = rng.choice(types)
            output = kind != "Condition" and rng.random() < 0.3
            tag = "output_port" if output else "input_port"
            default = {} if output or rng.random() < 0.7 else {"default": self._literal(port_type)}
            attributes = _attributes(name=f"port{place}", type=port_type, **default)
            model += f"<{tag}{attributes}>{quoteattr(hostile.text('what it is'))[1:-1]}</{tag}>"
            if not output:
                ports.append((f"port{place}", port_type))
        metadata = {"kind": kind} if kind != "Condition" else {}
        if self._inputs and rng.random() < 0.6:
            metadata["reads"] = rng.choice(self._inputs).partition(".")[0]
        if self._outputs and kind != "Condition" and rng.random() < 0.7:
            metadata["writes"] = rng.choice(self._outputs).partition(".")[0]
        if rng.random() < 0.2:
            metadata["hysteresis"] = hostile.text("some")
        fields = f"<MetadataFields><Metadata{_attributes(**metadata)}/></MetadataFields>" if metadata else ""
        tag = "Condition" if kind == "Condition" else "Action"
        return name, ports, f"<{tag}{_attributes(ID=name)}>{model}{fields}</{tag}>"

    def _literal(self, port_type: str) -> str:
        if port_type in _TEXT_TYPES:
            return self._hostile.text("text")
        if port_type in _FLOAT_TYPES:
            return self._hostile.integer("1.5", 0.15)
        return self._hostile.integer(self._rng.randint(0, 1) if port_type == "bool" else 3, 0.1)

    def _one_of(self, *values: int | str) -> int | str:
        return self._rng.choice(values)

    def _value(self) -> str:
        return self._hostile.integer(self._one_of(1, 2, "{alpha}", "text"))

    def _node(self, depth: int) -> str:
        rng = self._rng
        self._nodes += 1
        inner = self._nodes < MAX_NODES and depth < 5
        makers: list[Callable[[int], str]] = [self._use, self._built_in, self._script, self._script]
        if inner:
            makers += [self._control, self._control, self._parallel, self._decorator, self._decorator, self._switch]
        return rng.choice(makers)(depth)

    def _common(self) -> dict[str, str]:
        rng, hostile = self._rng, self._hostile
        result = {}
        if rng.random() < 0.3:
            result["name"] = hostile.text("a name")
        if rng.random() < 0.15:
            result[rng.choice(["_skipIf", "_while", "_failureIf", "_successIf"])] = self._condition()
        if rng.random() < 0.1:
            result[rng.choice(["_onSuccess", "_onFailure", "_post", "_onHalted"])] = self._statement()
        return result

    def _children(self, depth: int, least: int = 1, most: int = 3) -> tuple[int, str]:
        count = self._rng.randint(least, most)
        return count, "".join(self._node(depth + 1) for _ in range(count))

    def _control(self, depth: int) -> str:
        tag = self._rng.choice(_CONTROLS)
        return f"<{tag}{_attributes(**self._common())}>{self._children(depth)[1]}</{tag}>"

    def _parallel(self, depth: int) -> str:
        tag = self._rng.choice(list(_THRESHOLDS))
        count, children = self._children(depth)
        threshold = {_THRESHOLDS[tag]: self._hostile.integer(self._one_of(1, count, -1, "{alpha}"))}
        return f"<{tag}{_attributes(**threshold, **self._common())}>{children}</{tag}>"

    def _decorator(self, depth: int) -> str:
        tag = self._rng.choice(_PLAIN + 2 * list(_NUMBERED))
        number = {}
        if tag in _NUMBERED:
            number = {_NUMBERED[tag]: self._hostile.integer(self._one_of(0, 1, 3, 200, "{alpha}", "{gamma}"))}
        return f"<{tag}{_attributes(**number, **self._common())}>{self._node(depth + 1)}</{tag}>"

    def _switch(self, depth: int) -> str:
        rng = self._rng
        if rng.random() < 0.5:
            items = ";".join(self._hostile.integer(item) for item in (1, 2, 3))
            return f"<LoopInt{_attributes(queue=items, value='{alpha}')}>{self._node(depth + 1)}</LoopInt>"
        cases = {f"case_{number}": self._hostile.integer(number) for number in (1, 2)}
        variable = rng.choice([f"{{{name}}}" for name in _ENTRIES])
        children = "".join(self._node(depth + 1) for _ in range(3))
        return f"<Switch2{_attributes(variable=variable, **cases)}>{children}</Switch2>"

    def _built_in(self, _depth: int) -> str:
        rng = self._rng
        tag = rng.choice(["AlwaysSuccess", "AlwaysFailure", "Sleep", "TestNode", "SetBlackboard"])
        own = {
            "Sleep": {"msec": self._hostile.integer(rng.choice([0, 5, 300]))},
            "TestNode": {"return_status": rng.choice(["SUCCESS", "FAILURE"]), "async_delay": self._hostile.integer(30)},
            "SetBlackboard": {"value": self._hostile.integer(5), "output_key": rng.choice(_ENTRIES)},
        }.get(tag, {})
        return f"<{tag}{_attributes(**own, **self._common())}/>"

    def _use(self, _depth: int) -> str:
        name, ports, model = self._rng.choice(self._leaves)
        given = {port: self._literal(port_type) for port, port_type in ports}
        tag = "Condition" if model.startswith("<Condition") else "Action"
        return f"<{tag}{_attributes(ID=name, **given, **self._common())}/>"

    def _script(self, _depth: int) -> str:
        if self._rng.random() < 0.4:
            return f"<ScriptCondition{_attributes(code=self._condition())}/>"
        return f"<Script{_attributes(code=self._statement(), **self._common())}/>"

    def _statement(self) -> str:
        rng = self._rng
        target = rng.choice(_ENTRIES) if rng.random() < 0.8 or not self._outputs else rng.choice(self._outputs)
        operator = rng.choice([":=", "=", "+=", "-=", "*="]) if "." not in target else "="
        return f"{target} {operator} {self._expression(0)}"

    def _condition(self) -> str:
        rng = self._rng
        text = f"{self._expression(0)} {rng.choice(_COMPARISONS)} {self._expression(0)}"
        if rng.random() < 0.1:
            text += f" && alpha == {quoteattr(self._hostile.text('x'))}"
        return text

    def _expression(self, depth: int) -> str:
        rng = self._rng
        if depth < 2 and rng.random() < 0.4:
            return f"({self._expression(depth + 1)} {rng.choice(_OPERATORS)} {self._expression(depth + 1)})"
        if depth < 2 and rng.random() < 0.1:
            return f"({self._condition()} ? {self._expression(2)} : {self._expression(2)})"
        names = _ENTRIES + self._inputs
        return rng.choice([rng.choice(names), rng.choice(names), self._hostile.integer(rng.choice([0, 1, 7, 1000]))])
