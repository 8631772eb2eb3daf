# SPDX-License-Identifier: MIT
"""Scripts: BehaviorTree.CPP's little language, typed at compile time and written as C.

- `syntax`    text -> statements (abstract syntax, with places)
- `values`    what an expression is: a constant, a fixed-point number with its range, a double, a text
- `arithmetic` operators on values, exact or refused
- `compile`   statements and names -> the body of a C function
"""
