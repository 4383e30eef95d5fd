#compdef projdist
# eval "$(projdist completion zsh)" in ~/.zshrc, below compinit
_projdist() {
    local -a found
    found=("${(@f)$(PROJDIST_COMPLETE=1 "${words[1]}" "${(@)words[2,CURRENT]}" 2>/dev/null)}")
    if [[ -n "${found[1]}" ]]; then
        compadd -S '' -- ${(M)found:#*:}
        compadd -- ${found:#*:}
    else
        _files
    fi
}
compdef _projdist projdist
