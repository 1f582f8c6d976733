# Read by bash before each cell: a command that fails ends its cell, and with it the build. Jupyter asks for colours,
# which a page does not show.
set -eo pipefail
unset CLICOLOR CLICOLOR_FORCE FORCE_COLOR
export TERM=dumb
