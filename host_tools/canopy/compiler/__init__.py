# SPDX-License-Identifier: MIT
"""The compiler: a tree (BehaviorTree.CPP XML) and a bus (DBC) in, C tables, codecs, prototypes and a model file out.

The way of the data, one module a step:

- `xml_reader`   XML text -> elements with line and column
- `leaf_model`   <TreeNodesModel> -> declarations of the user's leaves
- `tree_reader`  elements -> tree of nodes, checked against the node types (`node_types`) and the leaves
- `table`        tree of nodes -> the engine's node table, parameters and state words
- `bus_reader`   DBC -> messages and signals as this controller sees them
- `budget`       what the application costs: RAM, flash, leaf calls, bus load
- `emit`         everything -> files, through the templates
"""
