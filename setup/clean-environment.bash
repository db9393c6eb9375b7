# SPDX-License-Identifier: BSD-3-Clause
# shellcheck shell=bash
# Undoes what another ROS, a conda, a pyenv or a virtual environment left in this shell, so that
# Debian's Python and Debian's ROS are the ones found. Sourced, never run.

unset AMENT_PREFIX_PATH CMAKE_PREFIX_PATH COLCON_PREFIX_PATH PKG_CONFIG_PATH LD_LIBRARY_PATH
unset ROS_DISTRO ROS_ETC_DIR ROS_PACKAGE_PATH ROS_PYTHON_VERSION ROS_ROOT ROS_VERSION ROSLISP_PACKAGE_DIRECTORIES
unset PYTHONHOME PYTHONPATH PYTHONSTARTUP CONDA_PREFIX
unset PYTHONDONTWRITEBYTECODE   # every start would compile all modules anew
export PYTHONNOUSERSITE=1     # a numpy in ~/.local would shadow the one that Debian's packages are built with

VIRTUAL_ENV=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)/.venv
export VIRTUAL_ENV PATH="$VIRTUAL_ENV/bin:/usr/bin:/bin:/usr/sbin:/sbin:$PATH"
