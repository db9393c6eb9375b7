# SPDX-License-Identifier: BSD-3-Clause
# shellcheck shell=bash
# The environment in which the hive's programs run: Debian's ROS, the wheels, and this clone's build.
# ./hive sources it; a shell of your own can do so too: `source setup/environment.bash`.

# shellcheck source-path=SCRIPTDIR source=clean-environment.bash
source "$(dirname "${BASH_SOURCE[0]}")/clean-environment.bash"

# A master that the caller did not name stays unnamed, so that a program may still choose its own.
_hive_master=${ROS_MASTER_URI:-}
# shellcheck source=/dev/null  # made by ./hive setup from catkin's devel/setup.bash
source "${VIRTUAL_ENV%/.venv}/devel/environment.bash"
if [[ -n $_hive_master ]]; then export ROS_MASTER_URI=$_hive_master; else unset ROS_MASTER_URI; fi

# On one machine everything talks over loopback. With a master elsewhere, the caller knows the address.
if [[ -z ${ROS_IP:-}${ROS_HOSTNAME:-} && ${_hive_master:-http://localhost} =~ ^http://(localhost|127\.) ]]; then
  export ROS_IP=127.0.0.1
fi
unset _hive_master

# ROS's C++ nodes would listen on all interfaces in spite of ROS_IP (docs/security.md).
_hive_bind=${VIRTUAL_ENV%/.venv}/devel/lib/libhive_bind_address.so
if [[ -f $_hive_bind && :${LD_PRELOAD:-}: != *:$_hive_bind:* ]]; then
  export LD_PRELOAD=$_hive_bind${LD_PRELOAD:+:$LD_PRELOAD}
fi
unset _hive_bind

# Other catkin workspaces on top of this one, such as ROS's own navigation stack: HIVE_OVERLAYS holds
# their devel or install folders, separated by colons. What is sourced by hand before is cleared above.
_hive_overlay() {
  local options=$- folder
  set +eu   # catkin's scripts are not written for these
  while IFS= read -r -d : folder; do
    [[ -n $folder ]] || continue
    if [[ -f $folder/setup.bash ]]; then
      # shellcheck source=/dev/null
      source "$folder/setup.bash" --extend
    else
      echo "hive: HIVE_OVERLAYS names $folder, which holds no setup.bash; name a devel or install folder" >&2
    fi
  done <<<"${HIVE_OVERLAYS:-}:"
  [[ $options != *e* ]] || set -e
  [[ $options != *u* ]] || set -u
}
_hive_overlay
unset -f _hive_overlay

# Names that packages had before, last so that any package of that name goes before.
export ROS_PACKAGE_PATH=$ROS_PACKAGE_PATH:${VIRTUAL_ENV%/.venv}/setup/old_names
