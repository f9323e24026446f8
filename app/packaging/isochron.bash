# Completion for bash. Commands, options and what they take are read from the program's own --help.

_isochron() {
  local word="${COMP_WORDS[COMP_CWORD]}" previous="${COMP_WORDS[COMP_CWORD - 1]}" command="" i help takes
  # Bash splits --option=value into three words.
  if [[ $word == "=" ]]; then
    word=""
  elif [[ $previous == "=" ]]; then
    previous="${COMP_WORDS[COMP_CWORD - 2]}"
  fi
  for ((i = 1; i < COMP_CWORD; ++i)); do
    if [[ ${COMP_WORDS[i]} != -* ]]; then
      command="${COMP_WORDS[i]}"
      break
    fi
  done
  help="$("${COMP_WORDS[0]/#\~\//$HOME/}" $command --help 2>/dev/null)" || return

  # What the option before takes (`  -o,--output DIR  folder ...`); else options, or what the command's argument is.
  takes="$(awk -v option="$previous" '/^  -/ && index("," $1 ",", "," option ",") && !/^  [^ ]+  / {print $2}' <<<"$help")"
  if [[ -z $takes && $word == -* ]]; then
    COMPREPLY=($(compgen -W "$(awk '/^  -/ {gsub(",", " ", $1); print $1}' <<<"$help")" -- "$word"))
    return
  fi
  if [[ -z $takes && -z $command ]]; then
    COMPREPLY=($(compgen -W "$(awk '/^[^ ]/ {list = /^Subcommands:/} list && /^  [a-z]/ {print $1}' <<<"$help")" -- "$word"))
    return
  fi
  [[ -n $takes ]] || takes="$(awk '/^[^ ]/ {list = /^Positionals:/} list && /^  [a-z]/ {print $2; exit}' <<<"$help")"
  case "$takes" in
    POINT) COMPREPLY=($(compgen -W "initial target" -- "$word")) ;;
    *:{*}*) takes="${takes#*\{}"; COMPREPLY=($(compgen -W "${takes%%\}*}" -- "$word")) ;;
    DIR*) _isochron_files ;;
    FILE) _isochron_files "*" ;;
    *.*) _isochron_files "*.${takes##*.}" ;;
  esac
}

# Folders that the word begins, and files that match a pattern.
_isochron_files() {
  compopt -o filenames
  mapfile -t COMPREPLY < <(
    compgen -d -- "$word"
    (($# == 0)) || compgen -f -X "!$1" -- "$word"
  )
}

complete -F _isochron isochron
