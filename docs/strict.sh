# Read by bash before each cell: a command that fails ends its cell, and with it the build.
set -eo pipefail
