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
