# SPDX-License-Identifier: BSD-3-Clause
# shellcheck shell=bash
# What `./hive setup` does: Debian packages, the virtual environment with its wheels, the catkin build.
# Each part asks first whether anything is missing, and does nothing otherwise. Sourced by ./hive.
# Asking takes a quarter of a second, so `is_ready` first looks whether anything changed since the last time.

readonly log=${root:?}/.hive/setup.log
readonly ready=$root/.hive/ready   # holds the clone's place; as old as the last look that found nothing missing

# --- what has changed --------------------------------------------------------------------------------

# A file that a copy or a checkout gave an old date still has a new change time. A removed file changes its folder's.
nothing_changed_since() {
  [[ -z $(find "$root/setup" "$root/src" -name __pycache__ -prune -o -cnewer "$1" \
    \( -type d -o -name '*.py' -o -name '*-packages.txt' -o "${build_files[@]}" \) -print -quit) ]]
}

# Only builtins and one find: every word of ./hive waits for this.
is_ready() {
  local place=''
  { read -r place <"$ready"; } 2>/dev/null
  [[ $place == "$root" && -x $root/.venv/bin/python && -f $root/.venv/stamp && -f $root/.venv/loops-stamp &&
    -f $root/devel/stamp && -f $root/devel/setup.bash && -f $root/devel/environment.bash &&
    ! /var/lib/dpkg/status -nt $ready ]] && nothing_changed_since "$ready"
}

# --- what is missing ---------------------------------------------------------------------------------

missing_packages() {
  comm -23 \
    <(sed 's/#.*//' "$root/setup/apt-packages.txt" | xargs -n1 | sort -u) \
    <(dpkg-query -W -f='${db:Status-Status} ${Package}\n' 2>/dev/null | sed -n 's/^installed //p' | sort -u)
}

# The stamps hold what the wheels and the build depend on; a clone that was moved needs both anew.
wheels_stamp() {
  { echo "$root"; cat "$root/setup/pip-packages.txt"; } | sha256sum
}

readonly build_files=(-name CMakeLists.txt -o -name package.xml -o -name setup.py
  -o -name '*.msg' -o -name '*.srv' -o -name '*.action' -o -name '*.c')

build_stamp() {
  {
    echo "$root"
    find "$root/src" -type f \( "${build_files[@]}" \) -print0 | sort -z | xargs -0 sha256sum
  } | sha256sum
}

wheels_are_there() { [[ -x $root/.venv/bin/python && $(cat "$root/.venv/stamp" 2>/dev/null) == "$(wheels_stamp)" ]]; }
build_is_there() { [[ -f $root/devel/setup.bash && -f $root/devel/environment.bash && $(cat "$root/devel/stamp" 2>/dev/null) == "$(build_stamp)" ]]; }

# --- showing that something happens ------------------------------------------------------------------

say() { printf 'hive: %s\n' "$*" >&2; }
die() { say "$@"; exit 1; }

# On a terminal, shows the seconds and the last line of the log until this script or the step ends.
show_progress() {
  local started=$SECONDS
  while sleep 1 && kill -0 $$ 2>/dev/null; do
    printf '\r\e[K  %3d s  %.68s' $((SECONDS - started)) "$(tail -n 1 "$log" | tr -d '\r\e')" >&2
  done
}

# step MESSAGE COMMAND...: runs the command, its output in the log, and returns what it returns.
step() {
  local message=$1 started=$SECONDS progress='' result=0
  shift
  say "$message ..."
  if [[ -t 2 ]]; then show_progress & progress=$!; fi
  printf '\n== %s: %s\n' "$(date '+%F %T')" "$message" >>"$log"
  "$@" </dev/null >>"$log" 2>&1 9>&- || result=$?
  if [[ -n $progress ]]; then
    kill "$progress" 2>/dev/null
    wait "$progress" 2>/dev/null || true
    printf '\r\e[K' >&2
  fi
  if ((result == 0)); then say "  done in $((SECONDS - started)) s"; fi
  return "$result"
}

# --- Debian packages ---------------------------------------------------------------------------------

# Prints the command that gives a program the rights to install, or fails when there is none.
find_administrator() {
  if ((EUID == 0)); then return; fi
  command -v sudo >/dev/null && sudo -v >&2 && echo sudo
}

# Runs a command as administrator. sudo drops proxy settings, so they are named again.
administer() {
  ${administrator:+"$administrator"} env DEBIAN_FRONTEND=noninteractive \
    ${http_proxy:+"http_proxy=$http_proxy"} ${https_proxy:+"https_proxy=$https_proxy"} ${no_proxy:+"no_proxy=$no_proxy"} "$@"
}

# Prints what this machine runs.
release() { ( . /etc/os-release && echo "${PRETTY_NAME:-an unknown system}" ) 2>/dev/null || uname -sr; }

readonly home_of_ros='ROS 1 is in Debian 12 and 13, and in the universe of Ubuntu 22.04 and 24.04'

# Prints those of some packages that apt does not know.
unknown_packages() {
  local name
  for name in "$@"; do
    apt-cache show --no-all-versions "$name" >/dev/null 2>&1 || echo "$name"
  done
}

apt_get() { administer apt-get -y -o Dpkg::Use-Pty=0 -o DPkg::Lock::Timeout=300 "$@"; }

# The first try fails where apt knows no packages yet, knows old ones only, or was interrupted before.
apt_install() {
  apt_get install --no-install-recommends "$@" ||
    { administer dpkg --configure -a && apt_get update && apt_get install --no-install-recommends "$@"; }
}

install_packages() {
  local missing unknown administrator
  mapfile -t missing < <(missing_packages)
  if ((${#missing[@]} == 0)); then return; fi
  if ! command -v apt-get >/dev/null; then
    die "this is $(release), which has no apt-get; $home_of_ros. Missing here: ${missing[*]}"
  fi
  administrator=$(find_administrator) ||
    die "Debian packages are missing and installing them needs root or sudo. Ask an administrator for:" \
      "apt-get install --no-install-recommends ${missing[*]}"
  step "installing Debian packages (${#missing[@]}, and what they need)" apt_install "${missing[@]}" ||
  {
    mapfile -t unknown < <(unknown_packages "${missing[@]}")
    if ((${#unknown[@]})); then
      die "this is $(release), and its package sources lack: ${unknown[*]}. $home_of_ros (whole log: $log)"
    fi
    die "apt-get failed on $(release): $(grep '^E: ' "$log" | sort -u | tail -n 3 | tr '\n' ' ')(whole log: $log). Missing: $(missing_packages | xargs)"
  }
}

# --- wheels ------------------------------------------------------------------------------------------

make_venv() {
  rm -f "$root/.venv/stamp"
  # Its scripts hold its path: one that was made elsewhere is of no use here.
  if ! grep -qs " $root/.venv\$" "$root/.venv/pyvenv.cfg"; then rm -rf "$root/.venv"; fi
  /usr/bin/python3 -m venv --system-site-packages "$root/.venv" &&
    "$root/.venv/bin/python" -m pip install --no-user --disable-pip-version-check --progress-bar off \
      -r "$root/setup/pip-packages.txt" &&
    wheels_stamp >"$root/.venv/stamp"
}

install_wheels() {
  if wheels_are_there; then return; fi
  step "installing wheels into .venv" make_venv ||
    die "pip failed: $(grep -E '^(Could not fetch|ERROR:)' "$log" | tail -n 2 | cut -c -300 | xargs -d '\n') (whole log: $log)"
}

# --- build -------------------------------------------------------------------------------------------

make_build() {
  rm -f "$root/devel/stamp"
  # CMake refuses a build folder that was made for another place.
  if ! grep -qs "^CMAKE_HOME_DIRECTORY:INTERNAL=$root/src\$" "$root/build/CMakeCache.txt"; then
    rm -rf "$root/build" "$root/devel"
  fi
  env -u CC -u CXX -u CFLAGS -u CXXFLAGS -u LDFLAGS -u MAKEFLAGS \
    catkin_make -C "$root" -DPYTHON_EXECUTABLE="$root/.venv/bin/python3" &&
    write_environment && build_stamp >"$root/devel/stamp"
}

# Writes down what sourcing devel/setup.bash yields, which takes catkin a tenth of a second each time.
write_environment() {
  local names='^(CMAKE_PREFIX_PATH|LD_LIBRARY_PATH|PKG_CONFIG_PATH|PYTHONPATH|ROS[A-Z_]*)='
  # shellcheck disable=SC2016  # the inner shell expands
  env -i PATH="$root/.venv/bin:/usr/bin:/bin" bash -c '
    source "$1/devel/setup.bash" || exit
    while read -r line; do printf "export %s=%q\n" "${line%%=*}" "${line#*=}"; done < <(env | grep -E "$2" | sort)
    printf "export PATH=%q:\$PATH\n" "$1/devel/bin"' - "$root" "$names" >"$root/devel/environment.bash"
}

build_workspace() {
  if build_is_there; then return; fi
  step "building the workspace" make_build ||
    die "catkin_make failed: $(grep -m 1 -A 3 -E '^CMake Error|[Ee]rror:' "$log" | xargs) (whole log: $log)"
}

# --- compiled loops ----------------------------------------------------------------------------------

# numba compares each source with what it compiled, by time and size; so does this stamp.
loops_stamp() {
  {
    echo "$root"
    { grep -rl --include='*.py' '^from hive_common.compiled import' "$root"/src/*/src || true; } |
      sort | xargs -r stat -c '%n %Y %s'
  } | sha256sum
}

loops_are_there() { [[ $(cat "$root/.venv/loops-stamp" 2>/dev/null) == "$(loops_stamp)" ]]; }

make_loops() {
  "$root/.venv/bin/python" "$root/setup/compile_loops.py" && loops_stamp >"$root/.venv/loops-stamp"
}

compile_loops() {
  if loops_are_there; then return; fi
  step "compiling inner loops" make_loops ||
    die "compiling failed: $(tail -n 1 "$log") (whole log: $log)"
}

# ------------------------------------------------------------------------------------------------------

nothing_is_missing() {
  [[ -z $(missing_packages) ]] && wheels_are_there && build_is_there && loops_are_there
}

# looked COMMAND...: runs a command and, if it succeeds, notes that nothing was missing when it began.
# Whoever may not write in this clone looks again every time.
looked() {
  local began
  began=$(mktemp)
  if ! "$@"; then rm "$began"; return 1; fi
  echo "$root" >"$began.new" && touch -r "$began" "$began.new"
  { mkdir -p "$root/.hive" && mv "$began.new" "$ready"; } 2>/dev/null || true
  rm -f "$began" "$began.new"
}

install_missing() {
  # shellcheck source-path=SCRIPTDIR source=clean-environment.bash
  source "$root/setup/clean-environment.bash"
  : >"$log"
  install_packages
  install_wheels
  build_workspace
  compile_loops
}

# Makes this clone ready to run, quickly when it is. A second ./hive waits until the first has done it.
set_up() {
  if is_ready || looked nothing_is_missing; then return; fi
  mkdir -p "$root/.hive"
  (
    flock -n 9 || { say "waiting for another ./hive that sets up"; flock 9; }
    if nothing_is_missing; then exit; fi
    install_missing
  ) 9>"$root/.hive/lock"
}
