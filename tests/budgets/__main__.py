"""`python -m tests.budgets` prints every count beside its budget; with `--record` they become the budgets."""

from __future__ import annotations

import json
import sys

from .ledger import PATH, budgets, counts, exceeded


def main() -> None:
    allowed, result = budgets() if PATH.exists() else {}, counts()
    for name, count in result.items():
        print(f"{name:64}{count:10.4g}{allowed.get(name, 0):10.4g}")
    if "--record" in sys.argv[1:]:
        PATH.write_text(
            json.dumps({name: round(count, 3) for name, count in result.items()}, indent=1) + "\n"
        )
        return
    over = exceeded(result, allowed)
    print(*over, sep="\n")
    sys.exit(bool(over))


if __name__ == "__main__":
    main()
