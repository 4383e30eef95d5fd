# projdist completion fish > ~/.config/fish/completions/projdist.fish
function __projdist_completion
    set -l given (commandline -opc) (commandline -ct)
    PROJDIST_COMPLETE=1 $given[1] $given[2..] 2>/dev/null
end
complete -c projdist -a '(__projdist_completion)'
