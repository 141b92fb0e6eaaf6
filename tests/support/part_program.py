"""A stand-in for `hairkit` in job files: it notes how it was called, one file a call."""

import sys
from pathlib import Path

words = sys.argv[1:]
out = Path(words[words.index("-o") + 1])
what = words[words.index("--part") + 1].replace("/", "of") if "--part" in words else "report"
(out / f"called-{what}").write_text("\n".join(words))
