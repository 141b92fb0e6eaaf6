"""Lets Python run in the folder above a clone that is named `hairkit`.

There the clone itself would be imported as a package without content, since the current folder
comes before installed packages. This file puts the package inside the clone in its place.
"""

import importlib.util
import sys
from pathlib import Path

if __name__ == "hairkit":
    _spec = importlib.util.spec_from_file_location(
        __name__, Path(__file__).parent / "hairkit" / "__init__.py"
    )
    assert _spec is not None
    assert _spec.loader is not None
    sys.modules[__name__] = importlib.util.module_from_spec(_spec)
    _spec.loader.exec_module(sys.modules[__name__])
