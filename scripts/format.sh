#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Formats all C++ files of the repository; --check changes nothing and fails if a file is not formatted.
set -euo pipefail
cd "$(dirname "$0")/.."

mode=(-i)
[ "${1:-}" != --check ] || mode=(--dry-run -Werror)
find stillmap apps fuzz lab python -name '*.[ch]pp' -print0 | xargs -0 -n 16 -P "$(nproc)" build/venv/bin/clang-format "${mode[@]}"
