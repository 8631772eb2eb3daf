# SPDX-License-Identifier: MIT
"""Text from files, from a bus and from the command line, made harmless for the place that it goes to.

One module for each target: `c` (and the templates of C), `make`, `markup` (SVG), `dot`, `json_text` (JSON and SARIF),
`lcm_text`, and `terminal`, through which everything is printed. Nothing else in the host tools writes such text.
"""
