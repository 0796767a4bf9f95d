"""Look up known vulnerabilities of the pinned packages, and say clearly where that is not possible.

    python tools/audit.py PIP_AUDIT FILE...

Exit status: 0 none is known, 1 some are, 3 not every package could be looked up.
"""

from __future__ import annotations

import json
import subprocess
import sys


def main() -> int:
    """Audit each file and print what is known."""
    program, *files = sys.argv[1:]
    options = ["--require-hashes", "--disable-pip", "--progress-spinner", "off", "--format", "json"]
    looked_up, known, unknown = 0, 0, []
    for file in files:
        done = subprocess.run([program, *options, "-r", file], capture_output=True, encoding="utf-8", check=False)
        try:
            packages = json.loads(done.stdout)["dependencies"]
        except (ValueError, KeyError, TypeError):
            print(f"note: {file} was not audited: {(done.stderr.strip().splitlines() or ['no answer'])[-1]}")
            unknown.append(file)
            continue
        for package in packages:
            if "skip_reason" in package:
                unknown.append(package["name"])
                continue
            looked_up += 1
            for fault in package["vulns"]:
                known += 1
                mended = ", ".join(fault["fix_versions"]) or "no version yet"
                print(f"{package['name']} {package['version']}: {fault['id']}, mended in {mended}")
    print(f"{looked_up} packages looked up, {known} known vulnerabilities")
    if unknown:
        print(
            f"note: {len(unknown)} could not be looked up: no index that lists vulnerabilities can be reached from here"
        )
    return 1 if known else 3 if unknown else 0


if __name__ == "__main__":
    sys.exit(main())
