# eval "$(projdist completion bash)" in ~/.bashrc
_projdist_completion() {
    local IFS=$'\n'
    COMPREPLY=($(PROJDIST_COMPLETE=1 "$1" "${COMP_WORDS[@]:1:COMP_CWORD}" 2>/dev/null))
    if [[ ${#COMPREPLY[@]} == 1 && ${COMPREPLY[0]} == *: ]]; then
        compopt -o nospace
    fi
}
complete -o bashdefault -o default -F _projdist_completion projdist
