# SPDX-License-Identifier: MIT
"""The compiler: a tree (BehaviorTree.CPP XML) and a bus (DBC) in, C tables, codecs, prototypes and a model file out.

The way of the data, one module a step:

- `xml_reader`   XML text -> elements with line and column
- `documents`    a file and those it includes -> trees by ID, and the models' declarations (`leaf_model`, `port_types`)
- `tree_reader`  elements -> one tree of nodes (`tree`), subtrees expanded, checked against `node_types`; `scripted`
                 for the nodes that ask scripts, `blackboard` for the names of each instance
- `bus_reader`   DBC (`dbc_file`, `signal_reader`) -> messages and signals as this controller sees them
- `binding`      tree and bus -> types of entries, scripts as C (`script`, `script_bodies`), what ports are connected to
- `table`        tree of nodes -> the engine's node table, parameters, state words and scripts
- `budget`       what the application costs: RAM, flash, leaf calls, bus load
- `emit`         everything -> files, through the templates (`leaf_c`: the user's functions; `stubs`: their skeletons)
"""
