# SPDX-License-Identifier: BSD-3-Clause
# shellcheck shell=bash
# What `./hive shell` starts with: the user's own settings first, so that they cannot undo ours.

# shellcheck source=/dev/null
[[ -f ~/.bashrc ]] && source ~/.bashrc
# shellcheck source-path=SCRIPTDIR source=environment.bash
source "$(dirname "${BASH_SOURCE[0]}")/environment.bash"
# shellcheck source-path=SCRIPTDIR source=completion.bash
source "$(dirname "${BASH_SOURCE[0]}")/completion.bash"
PS1="(hive) $PS1"
