#!/usr/bin/env bash
# Run targets of make one after the other, and print a table of their times and results:
# scripts/nightly.sh TARGET ...
# A failed target does not stop the others. The status is 1 if one failed.
set -uo pipefail
status=0
table=""
for target in "$@"; do
  start=$SECONDS
  result=passed
  make --no-print-directory "$target" || { result=FAILED; status=1; }
  table+=$(printf '%-16s %3d min  %s' "$target" $(((SECONDS - start + 30) / 60)) "$result")$'\n'
done
printf '\n%s' "$table"
exit $status
