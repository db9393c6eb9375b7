# SPDX-License-Identifier: BSD-3-Clause
# shellcheck shell=bash
# Tab completion in bash for ./hive and, where the environment is sourced, hive. `./hive shell` has it;
# a shell of your own gets it by `source setup/completion.bash`, as in ~/.bashrc.

# Bash's own words are answered here, all others by the command line itself, without looking at the set-up.
_hive_complete() {
  local root program=${COMP_WORDS[1]} word=${COMP_WORDS[COMP_CWORD]} words=("${COMP_WORDS[@]}") index=$COMP_CWORD kind value
  root=$(readlink -f "$(dirname "${BASH_SOURCE[0]}")/..")
  COMPREPLY=()
  if ((COMP_CWORD == 1)); then
    mapfile -t COMPREPLY < <(compgen -W "$(sed -n 's/^# words: //p' "$root/hive")" -- "$word")
    if [[ ${words[0]} == hive ]]; then   # the command line, which lacks the words of the front door
      mapfile -t COMPREPLY < <(printf '%s\n' "${COMPREPLY[@]}" | grep -vxE 'setup|test|shell|help|')
    fi
    return
  fi
  case ${COMP_WORDS[1]} in
    setup | help) return ;;
    shell) mapfile -t COMPREPLY < <(compgen -W -c -- "$word"); return ;;
    test) mapfile -t COMPREPLY < <(compgen -W "quick unit hive rostest gui" -- "$word"; compgen -f -- "$word"); return ;;
    bench) words=(hive "${words[@]:2}") index=$((index - 1)) ;;   # a program of its own
  esac
  while IFS=, read -r kind value; do
    case $kind in
      file) mapfile -t -O "${#COMPREPLY[@]}" COMPREPLY < <(compgen -f -- "$word") ;;
      dir) mapfile -t -O "${#COMPREPLY[@]}" COMPREPLY < <(compgen -d -- "$word") ;;
      *) COMPREPLY+=("$value") ;;
    esac
  done < <(COMP_WORDS="${words[*]}" COMP_CWORD=$index _HIVE_COMPLETE=bash_complete "$root/hive" "$program" 2>/dev/null)
}
complete -o nosort -F _hive_complete hive ./hive
