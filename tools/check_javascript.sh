#!/bin/sh
# Check the types that the JavaScript of the page has in its comments. The checker is installed by
# npm into .venv, as locked, and again when the lock changes; nothing of it goes to a robot.
# Without npm it says so in a line; with EXPERIENCE_SKIP_NOTHING set that is an error.
set -eu

cd "$(dirname "$0")/.."
FOLDER="${VENV:-.venv}/javascript"
STAMP="$FOLDER/setup-stamp"

if ! command -v npm >/dev/null 2>&1; then
    echo "JavaScript is not checked: there is no npm ('apt install npm')"
    [ -z "${EXPERIENCE_SKIP_NOTHING:-}" ]
    exit
fi

key=$(cat tools/javascript/package-lock.json tools/javascript/package.json | cksum)
if [ ! -f "$STAMP" ] || [ "$(cat "$STAMP")" != "$key" ]; then
    rm -rf "$FOLDER"
    mkdir -p "$FOLDER"
    cp tools/javascript/package.json tools/javascript/package-lock.json "$FOLDER"
    if ! npm ci --loglevel=error --no-audit --no-fund --prefix "$FOLDER"; then
        echo 'check_javascript: npm could not install the checker; is its registry reachable?' >&2
        exit 2
    fi
    echo "$key" >"$STAMP"
fi
"$FOLDER/node_modules/.bin/tsc" --project tools/javascript
echo 'The JavaScript of the page has the types it says.'
