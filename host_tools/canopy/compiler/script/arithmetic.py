# SPDX-License-Identifier: MIT
"""The operators of scripts. Whole and fixed-point numbers are exact: what would be rounded is refused by name.

Results that might not fit into 64 bits saturate, and are counted (canopy/script.h); there is no undefined behaviour.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction

from canopy.compiler.errors import nearest
from canopy.compiler.numbers import exact, plain
from canopy.compiler.script.syntax import ScriptError
from canopy.compiler.script.values import (
    INT64,
    Const,
    Double,
    Num,
    TextConst,
    TextVar,
    Value,
    boolean,
    common_scale,
    describe,
    literal,
    number,
    result,
)

_MIRRORED = {"<": ">", "<=": ">=", ">": "<", ">=": "<=", "==": "==", "!=": "!="}
_COMPARE = {
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
    "==": operator.eq,
    "!=": operator.ne,
}
RANK = "text_rank"
"""The C function that gives a text's place in the order of texts."""
_HELPERS = {"+": "canopy_add", "-": "canopy_subtract", "*": "canopy_multiply"}


class Arithmetic:
    """The operators. `floats`: is floating point allowed? `faults`: C pointer to the fault counter.

    `text_index` gives the place of a text in the application's table.
    """

    def __init__(self, floats: bool, faults: str, text_index: Callable[[str], int]) -> None:
        self.floats = floats
        self._text_index = text_index
        self._faults = faults

    def truth(self, value: Value, index: int) -> Num | Const:
        """The value as a condition: is it other than 0?"""
        if isinstance(value, Const):
            return Const(Fraction(value.value != 0), is_bool=True)
        if isinstance(value, Num):
            return value if value.is_bool else boolean(f"({value.c} != 0)")
        if isinstance(value, Double):
            return boolean(f"({value.c} != 0.0)")
        raise ScriptError(index, f"{describe(value)} is neither true nor false", "compare it: name == 'text'")

    def double(self, value: Value, index: int) -> str:
        """The value as a C double."""
        if isinstance(value, Double):
            return value.c
        if isinstance(value, Const):
            return repr(_as_float(value.value, index))
        if isinstance(value, Num):
            text = f"(double){value.c}"
            if value.scale.numerator != 1:
                text += f" * {_as_float(value.scale.numerator, index)!r}"
            if value.scale.denominator != 1:
                text += f" / {_as_float(value.scale.denominator, index)!r}"
            return text if value.scale == 1 else f"({text})"
        raise ScriptError(index, f"{describe(value)} is no number")

    def scaled(self, value: Num | Const, scale: Fraction, index: int) -> Num:
        """The same number in steps of `scale`, of which its own step is a multiple."""
        if isinstance(value, Const):
            steps = int(value.value / scale)
            if not INT64[0] <= steps <= INT64[1]:
                raise ScriptError(index, f"{plain(value.value)} is too large for 64 bits")
            return literal(steps, scale)
        if value.scale == scale:
            return value
        factor = int(value.scale / scale)
        low, high = sorted((value.low * factor, value.high * factor))
        if low < INT64[0] or high > INT64[1]:
            raise ScriptError(
                index, "these numbers together need more than 64 bits", "compare numbers of similar steps"
            )
        new = result("", low, high, scale)
        return result(f"({value.as_type(new.wide)} * {number(factor, new.wide)})", low, high, scale)

    def unary(self, sign: str, value: Value, index: int) -> Value:
        """-x, !x, ~x."""
        if sign == "!":
            truth = self.truth(value, index)
            if isinstance(truth, Const):
                return Const(Fraction(truth.value == 0), is_bool=True)
            return boolean(f"!{truth.c}")
        if sign == "-":
            if isinstance(value, Const):
                return Const(-value.value)
            if isinstance(value, Double):
                return Double(f"(-{value.c})")
            return self.binary("-", Const(Fraction(0)), value, index)
        whole = self._whole(value, index, "~")
        if isinstance(whole, Const):
            return Const(Fraction(~int(whole.value)))
        # A function: gcc warns of a comparison with ~x when x was unsigned, whatever it was cast to.
        c = f"canopy_complement({whole.as_type(True)})"
        c = c if whole.wide else f"(int32_t){c}"
        return result(c, ~whole.high, ~whole.low, Fraction(1))

    def binary(self, sign: str, left: Value, right: Value, index: int) -> Value:
        """Arithmetic and bits."""
        if sign == ".." or (sign == "+" and isinstance(left, TextConst) and isinstance(right, TextConst)):
            return self._join(left, right, index)
        for value in (left, right):
            if isinstance(value, (TextConst, TextVar)):
                raise ScriptError(index, f"'{sign}' needs numbers, and one side is a text")
        if sign in "&|^":
            return self._bits(sign, left, right, index)
        if isinstance(left, Const) and isinstance(right, Const):
            return self._constant(sign, left, right, index)
        if sign == "/":
            return self._divide(left, right, index)
        if isinstance(left, Double) or isinstance(right, Double):
            return Double(f"({self.double(left, index)} {sign} {self.double(right, index)})")
        assert isinstance(left, (Num, Const))
        assert isinstance(right, (Num, Const))
        if sign == "*":
            return self._multiply(left, right, index)
        if isinstance(right, Const) and right.value == 0 and isinstance(left, Num):
            return _as_number(left)
        if sign == "+" and isinstance(left, Const) and left.value == 0 and isinstance(right, Num):
            return _as_number(right)
        scale = common_scale(_step(left), _step(right))
        first, second = self.scaled(left, scale, index), self.scaled(right, scale, index)
        if sign == "+":
            return self._exact("+", first, second, first.low + second.low, first.high + second.high, scale)
        return self._exact("-", first, second, first.low - second.high, first.high - second.low, scale)

    def _exact(self, sign: str, first: Num, second: Num, low: int, high: int, scale: Fraction) -> Num:
        units = (low * scale, high * scale)
        whole = first.scale.denominator == 1 and second.scale.denominator == 1
        if scale != 1 and whole and (units[0] < INT64[0] or units[1] > INT64[1]):
            # Whole numbers fit into 64 bits, whatever their step: so that they saturate where whole numbers do.
            one, two = self.scaled(first, Fraction(1), 0), self.scaled(second, Fraction(1), 0)
            return self._exact(sign, one, two, int(units[0]), int(units[1]), Fraction(1))
        if low < INT64[0] or high > INT64[1]:
            c = f"{_HELPERS[sign]}({first.as_type(True)}, {second.as_type(True)}, {self._faults})"
            return result(c, max(low, INT64[0]), min(high, INT64[1]), scale)
        wide = result("", low, high, scale).wide or first.wide or second.wide
        c = f"({first.as_type(wide)} {sign} {second.as_type(wide)})"
        return Num(c, "int64_t" if wide else "int32_t", low, high, scale)

    def _multiply(self, left: Num | Const, right: Num | Const, index: int) -> Value:
        if isinstance(left, Const):
            left, right = right, left
        assert isinstance(left, Num)
        if isinstance(right, Const):
            # A constant factor changes the step, not the number.
            if right.value == 0:
                return Const(Fraction(0))
            if right.value == 1:
                return _as_number(left)
            scale = left.scale * abs(right.value)
            ends = sorted((left.low * left.scale * right.value, left.high * left.scale * right.value))
            if left.scale.denominator == 1 and scale.denominator == 1 and (ends[0] < INT64[0] or ends[1] > INT64[1]):
                base, factor = self.scaled(left, Fraction(1), index), self.scaled(right, Fraction(1), index)
                return self._exact("*", base, factor, int(ends[0]), int(ends[1]), Fraction(1))
            number_ = Num(left.c, left.c_type, left.low, left.high, scale)
            return number_ if right.value > 0 else self.unary("-", number_, index)
        ends4 = [a * b for a in (left.low, left.high) for b in (right.low, right.high)]
        return self._exact("*", left, right, min(ends4), max(ends4), left.scale * right.scale)

    def _divide(self, left: Value, right: Value, index: int) -> Value:
        if isinstance(right, Const):
            if right.value == 0:
                raise ScriptError(index, "a division by 0")
            return self.binary("*", left, Const(1 / right.value), index)
        if not self.floats:
            raise ScriptError(
                index,
                "a division by what is no constant would be rounded",
                "multiply the other side instead (a > b * c), or compile with --allow-floating-point",
            )
        return Double(f"canopy_divide({self.double(left, index)}, {self.double(right, index)}, {self._faults})")

    def _constant(self, sign: str, left: Const, right: Const, index: int) -> Const:
        if sign == "/":
            if right.value == 0:
                raise ScriptError(index, "a division by 0")
            return Const(left.value / right.value)
        functions = {"+": operator.add, "-": operator.sub, "*": operator.mul}
        return Const(functions[sign](left.value, right.value))

    def _join(self, left: Value, right: Value, index: int) -> Value:
        texts = []
        for value in (left, right):
            if isinstance(value, TextConst):
                texts.append(value.text)
            elif isinstance(value, Const):
                texts.append(plain(value.value))
            else:
                raise ScriptError(
                    index, "only constant texts can be joined", "texts are constants here; use ?: to choose one"
                )
        return TextConst("".join(texts))

    def _whole(self, value: Value, index: int, sign: str) -> Num | Const:
        if isinstance(value, Const) and value.value.denominator == 1 and INT64[0] <= value.value <= INT64[1]:
            return value
        if isinstance(value, Num) and value.scale.denominator == 1:
            return self.scaled(value, Fraction(1), index)
        raise ScriptError(index, f"'{sign}' needs whole numbers, not {describe(value)}")

    def _bits(self, sign: str, left: Value, right: Value, index: int) -> Value:
        first, second = self._whole(left, index, sign), self._whole(right, index, sign)
        if isinstance(first, Const) and isinstance(second, Const):
            functions = {"&": operator.and_, "|": operator.or_, "^": operator.xor}
            return Const(Fraction(functions[sign](int(first.value), int(second.value))))
        one, two = self.scaled(first, Fraction(1), index), self.scaled(second, Fraction(1), index)
        wide = one.wide or two.wide
        if sign == "&" and max(one.low, two.low) >= 0:
            low, high = 0, min(side.high for side in (one, two) if side.low >= 0)
        elif one.low >= 0 and two.low >= 0:
            low, high = 0, 2 ** max(end.bit_length() for end in (one.high, two.high)) - 1
        else:
            # The fewest bits that hold both sides: C compilers warn of comparisons that these already decide.
            bits = max((~end if end < 0 else end).bit_length() for end in (one.low, one.high, two.low, two.high))
            low, high = -(2**bits), 2**bits - 1
        c = f"({one.as_type(wide)} {sign} {two.as_type(wide)})"
        masks = [int(side.value) for side in (first, second) if isinstance(side, Const)]
        zeros, ones = ~masks[0] if masks and sign == "&" else 0, masks[0] if masks and sign == "|" else 0
        return Num(c, "int64_t" if wide else "int32_t", low, high, zeros=zeros, ones=ones)

    def compare(self, sign: str, left: Value, right: Value, index: int) -> Num | Const:
        """One comparison; texts are in the order of their bytes."""
        texts = (TextConst, TextVar)
        if isinstance(left, texts) or isinstance(right, texts):
            return self._compare_texts(sign, left, right, index)
        if isinstance(left, Double) or isinstance(right, Double):
            return boolean(f"({self.double(left, index)} {sign} {self.double(right, index)})")
        assert isinstance(left, (Num, Const))
        assert isinstance(right, (Num, Const))
        if isinstance(left, Const):
            if isinstance(right, Const):
                return Const(Fraction(_COMPARE[sign](left.value, right.value)), is_bool=True)
            return self.compare(_MIRRORED[sign], right, left, index)
        if isinstance(right, Const):
            return self._compare_constant(sign, left, right, index)
        scale = common_scale(left.scale, right.scale)
        first, second = self.scaled(left, scale, index), self.scaled(right, scale, index)
        wide = first.wide or second.wide
        if first.c == second.c:  # C compilers warn of a number compared with itself
            return Const(Fraction(_COMPARE[sign](0, 0)), is_bool=True)
        return boolean(f"({_operand(first, wide)} {sign} {_operand(second, wide)})")

    def _compare_constant(self, sign: str, left: Num, right: Const, index: int) -> Num | Const:
        """Exactly: the constant is taken to the number's step, rounded so that the answer stays the same."""
        steps = right.value / left.scale
        bound = steps.numerator // steps.denominator
        if steps.denominator != 1:
            if sign in ("==", "!="):
                raise ScriptError(
                    index,
                    f"can never be equal: {plain(right.value)} is no multiple of the step {plain(left.scale)}",
                    "use < or >, or a multiple of the step",
                )
            # n < 2.5 is n <= 2; n > 2.5 is n > 2.
            sign = "<=" if sign in ("<", "<=") else ">"
        if not left.low <= bound <= left.high:
            # Decided by the range alone; an outside bound would need a wider type.
            return Const(
                Fraction(_COMPARE[sign](Fraction(left.high if bound > left.high else left.low), bound)), is_bool=True
            )
        if sign in ("==", "!=") and (bound & left.zeros or ~bound & left.ones):
            return Const(Fraction(sign == "!="), is_bool=True)
        always = {"<": bound > left.high, "<=": bound >= left.high, ">": bound < left.low, ">=": bound <= left.low}
        never = {"<": bound <= left.low, "<=": bound < left.low, ">": bound >= left.high, ">=": bound > left.high}
        if always.get(sign, False) or never.get(sign, False):  # by the range alone
            return Const(Fraction(always[sign]), is_bool=True)
        if left.is_bool and sign in ("==", "!="):
            return left if (bound == 1) == (sign == "==") else boolean(f"!{left.c}")
        return boolean(f"({_operand(left, left.wide)} {sign} {number(bound, left.wide)})")

    def _compare_texts(self, sign: str, left: Value, right: Value, index: int) -> Num | Const:
        if isinstance(left, TextConst) and isinstance(right, TextConst):
            return Const(Fraction(_COMPARE[sign](left.text.encode(), right.text.encode())), is_bool=True)
        if isinstance(left, TextConst):
            left, right, sign = right, left, _MIRRORED[sign]
        if isinstance(left, TextVar) and isinstance(right, (TextVar, TextConst)):
            if sign in ("==", "!="):
                return boolean(f"({left.c} {sign} {self.text(right)})")
            return boolean(f"({RANK}({left.c}) {sign} {RANK}({self.text(right)}))")
        if isinstance(left, Num) and left.choices and isinstance(right, TextConst):
            if right.text not in left.choices:
                raise ScriptError(
                    index, f"'{right.text}' is no value of this signal", nearest(right.text, left.choices)
                )
            return boolean(f"({_operand(left, left.wide)} {sign} {number(left.choices[right.text], left.wide)})")
        number_ = _number_of(right) if isinstance(right, TextConst) else None
        if number_ is not None and not isinstance(left, TextVar):
            return self.compare(sign, left, number_, index)
        raise ScriptError(index, f"{describe(left)} cannot be compared with {describe(right)}")

    def text(self, value: TextConst | TextVar) -> str:
        """The C expression of a text's place in the table."""
        return value.c if isinstance(value, TextVar) else f"{self._text_index(value.text)}u"

    def choose(self, condition: Num | Const, yes: Value, no: Value, index: int) -> Value:
        """Condition ? yes : no."""
        if isinstance(condition, Const):
            return yes if condition.value else no
        if isinstance(yes, Double) or isinstance(no, Double):
            return Double(f"({condition.c} ? {self.double(yes, index)} : {self.double(no, index)})")
        if isinstance(yes, (Num, Const)) and isinstance(no, (Num, Const)):
            is_bool = yes.is_bool and no.is_bool
            scale = common_scale(_step(yes), _step(no))
            first, second = self.scaled(yes, scale, index), self.scaled(no, scale, index)
            low, high = min(first.low, second.low), max(first.high, second.high)
            wide = first.wide or second.wide
            c = f"({condition.c} ? {first.as_type(wide)} : {second.as_type(wide)})"
            return Num(c, "int64_t" if wide else "int32_t", low, high, scale, is_bool)
        if isinstance(yes, (TextConst, TextVar)) and isinstance(no, (TextConst, TextVar)):
            return TextVar(f"(uint16_t)({condition.c} ? {self.text(yes)} : {self.text(no)})")
        raise ScriptError(index, f"'?:' chooses between {describe(yes)} and {describe(no)}", "both must be of one kind")


def _number_of(text: TextConst) -> Const | None:
    """The number that a text is, as BehaviorTree.CPP takes it where the other side is a number."""
    if text.text in ("true", "false"):
        return Const(Fraction(text.text == "true"), is_bool=True)
    try:
        return Const(exact(text.text))
    except ValueError:
        return None


def _as_float(value: Fraction | int, index: int) -> float:
    try:
        result = float(value)
    except OverflowError:
        raise ScriptError(index, "a number that is too large for floating point") from None
    if result == 0 and value != 0:
        raise ScriptError(index, "a number that is too small for floating point")
    return result


def _step(value: Num | Const) -> Fraction:
    """The step of a number; a constant's is such that it is a whole number of steps."""
    if isinstance(value, Num):
        return value.scale
    return abs(value.value) if value.value.denominator != 1 else Fraction(1)


def _as_number(value: Num) -> Num:
    """A truth value that was computed with is a number."""
    return replace(value, is_bool=False, choices={})


def _operand(value: Num, wide: bool) -> str:
    """`c` in a comparison: narrow types are promoted by C itself."""
    if not wide and value.c_type in ("bool", "int8_t", "uint8_t", "int16_t", "uint16_t"):
        return value.c
    return value.as_type(wide)
