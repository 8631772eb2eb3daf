# SPDX-License-Identifier: MIT
"""A trained scikit-learn decision tree as the JSON that `canopy convert decision-tree` reads.

Runs in your Python, where the estimator is: a pickle or joblib file runs whatever code its author has put into it, so
`canopy` reads none. It needs nothing but the estimator.

    from canopy.convert.sklearn_export import export

    export(estimator, "tree.json", signals=["Battery.Level", "Task.Urgency"])
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from canopy.escape.json_text import dumps
from canopy.files import write_files


def export(estimator: Any, path: str | Path, signals: Sequence[str], actions: Mapping[Any, str] | None = None) -> None:
    """Writes a fitted DecisionTreeClassifier as JSON.

    Args:
        estimator: a fitted `sklearn.tree.DecisionTreeClassifier` (any object with its `classes_` and `tree_`).
        path: the file to write.
        signals: for each feature, in the order of training, its signal in the DBC: "Message.Signal". The estimator must
            have been trained on physical values in the DBC's unit.
        actions: for each class its action's ID; the classes themselves if not given.

    Raises:
        ValueError: not a fitted classifier with one output, or the numbers of features or classes do not match.
    """
    tree = getattr(estimator, "tree_", None)
    classes = getattr(estimator, "classes_", None)
    if tree is None or classes is None or getattr(estimator, "n_outputs_", 1) != 1:
        raise ValueError("export() takes a fitted DecisionTreeClassifier with one output")
    if len(signals) != tree.n_features:
        raise ValueError(f"the estimator has {tree.n_features} features, and {len(signals)} signals are given")
    names = [str(one) if actions is None else actions.get(one) for one in classes.tolist()]
    if None in names:
        raise ValueError(f"actions has no entry for class {classes.tolist()[names.index(None)]!r}")

    def branch(node: int) -> dict[str, object]:
        left, right = int(tree.children_left[node]), int(tree.children_right[node])
        if left == right:  # a leaf: both are -1
            weights = tree.value[node][0].tolist()
            return {"do": names[weights.index(max(weights))]}
        predicate = {"signal": signals[int(tree.feature[node])], "at_most": float(tree.threshold[node])}
        return {"if": predicate, "then": branch(left), "else": branch(right)}

    content = {"comparison": "float32", "tree": branch(0)}
    write_files({Path(path): f"{dumps(content, indent=1)}\n".encode()})
