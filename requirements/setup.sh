#!/bin/sh
# setup.sh setup|reproduce|test: sets up what `make`, `make reproduce` or `make test` needs, and says first what that is;
# silent where nothing is left to do (but for `make`, which says that).
#
# - Debian packages, listed with their reasons in debian.txt. `make` only names them. The tests insist on them, `reproduce`
#   needs no windows and goes on without the rest. On a terminal they are asked for before they are installed.
# - .venv, with the packages that python.txt pins (those of laboratory.txt, which are PsychoPy and the tools of the tests,
#   only for `make test`) and focalgradient itself, editable: by uv if it is on the PATH, else, or
#   if uv fails, by pip. Both install the same files and check their hashes; uv does it in less time. The stamp .venv/ready
#   is written last and says for what the set-up was made: one that was cut off has no stamp and is started over.
set -eu
cd "$(dirname "$0")/.."
purpose=$1

say() { echo "set-up: $*" >&2; }
fail() { say "$*"; exit 1; }

# PsychoPy, and with it the windows of the experiments, is pinned for these machines only.
windows() {
    [ "$(uname -s) $(uname -m)" = "Linux x86_64" ]
}

agreed() { # whether to install Debian packages: asked on a terminal, else yes
    if [ ! -t 0 ] || [ ! -t 2 ]; then return 0; fi
    printf 'set-up: install the Debian packages%s? [y/N] ' "$1" >&2
    read -r answer && case $answer in [yY]*) true ;; *) false ;; esac
}

apt_update() { # apt-get itself waits for another program's lock on dpkg, but not for one on its lists
    for try in $(seq 60); do
        ! trouble=$($sudo env LC_ALL=C apt-get update -qq 2>&1) || return 0
        case $trouble in *"not get lock"*) ;; *) break ;; esac
        [ "$try" != 1 ] || say "waiting for another program that holds apt's lock"
        sleep 10
    done
    echo "$trouble" >&2
    return 1
}

debian_packages() {
    command -v dpkg-query >/dev/null || return 0
    missing=
    if [ "$purpose" = reproduce ] || ! windows; then leave='/# windows:/d'; else leave=; fi
    for package in $(sed -e "$leave" -e 's/#.*//' requirements/debian.txt); do
        dpkg-query -W -f '${db:Status-Abbrev}' "$package" 2>/dev/null | grep -q ^ii || missing="$missing $package"
    done
    [ -n "$missing" ] || return 0

    if [ "$purpose" = setup ]; then
        say "left out, as only windows of experiments, tests and path-traced scenes need them: the Debian packages$missing" \
            "('sudo apt-get install --no-install-recommends$missing')"
        return 0
    fi
    if [ "$(id -u)" = 0 ]; then sudo=; elif sudo -n true 2>/dev/null; then sudo=sudo; else sudo=none; fi
    if [ "$sudo" != none ] && ! agreed "$missing"; then
        trouble="they are not wanted"
    elif [ "$sudo" = none ]; then
        trouble="this user is not root and sudo asks for a password"
    else
        say "installing the Debian packages$missing"
        apt_update && $sudo env DEBIAN_FRONTEND=noninteractive apt-get -o DPkg::Lock::Timeout=600 \
            install -y -qq --no-install-recommends $missing >&2 && return 0
        trouble="apt-get could not install them (its message is above)"
    fi
    remedy="install them with 'sudo apt-get install --no-install-recommends$missing'."
    [ "$purpose" = reproduce ] || fail "the tests need the Debian packages$missing, but $trouble: $remedy"
    say "going on, by a simpler path, without the Debian packages$missing: $remedy"
}

version() { "$1" -c 'import platform; print(platform.python_version())' 2>/dev/null || echo missing; }
fits() { "$1" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; }

find_python() { # sets $python
    for python in ${PYTHON:-python3 python3.12 python3.11 python3.13 python3.14}; do
        ! fits "$python" || return 0
    done
    python=${PYTHON:-python3}
    fail "focalgradient needs Python 3.11 or newer, but $python is $(version "$python"):" \
        "install one and name it, as in 'make PYTHON=python3.12 $purpose'."
}

pins() { # what python.txt pins, all or without the packages of laboratory.txt
    if [ "$part" = all ]; then cat requirements/python.txt; return; fi
    awk 'NR == FNR { if ($0 !~ /^#/) left[$1]; next } /^[a-z0-9]/ { split($0, name, "=="); out = name[1] in left } !out' \
        requirements/laboratory.txt requirements/python.txt
}

python_wanted() { # sets $needed, and says what will be installed before anything is
    have=$(cat .venv/ready 2>/dev/null) || have=
    part=core
    case "$purpose $have" in test* | *" all "*) part=all ;; esac
    # A virtual environment cannot be moved, so its place is part of what it was made for.
    want="$PWD $part $(cat requirements/python.txt requirements/laboratory.txt pyproject.toml | cksum)"
    fits .venv/bin/python || have=
    [ -z "${PYTHON:-}" ] || [ "$(version "$PYTHON")" = "$(version .venv/bin/python)" ] || have=
    needed=
    [ "$have" != "$want" ] || return 0
    needed=yes
    if [ "${have% * * *}" != "$PWD" ]; then # none yet, cut off, moved, or of another Python
        find_python
        "$python" -c 'import ensurepip, venv' 2>/dev/null || fail "$python cannot make virtual environments:" \
            "install its venv module (on Debian: apt-get install python3-venv) and call make again."
    fi
    count=$(pins | grep -c '^[a-z0-9-]*==' || :)
    if [ "$part" = all ]; then size="600 MB to download, 2 GB"; else size="450 MB to download, 1.6 GB"; fi
    say "installs the packages that requirements/python.txt pins ($count, less those for other systems) into .venv: about" \
        "$size of disk, 2 to 10 minutes, once"
}

progress() { # how far pip is: it looks all packages up, downloads them, then installs one after another
    files=$(grep -E '^ *(Downloading|Using cached) [^ ]+\.(whl|tar\.gz|zip) ' .venv/pip.out || :)
    total=$((count - $(grep -c '^Ignoring ' .venv/pip.out || :))) # those for other systems
    if grep -q '^Installing collected' .venv/pip.out; then
        say "installing: $(find .venv/lib -maxdepth 3 -name '*.dist-info' ! -name 'pip-*' | wc -l) of $total packages, $1 s"
    elif [ -n "$files" ]; then
        say "downloading: $(echo "$files" | wc -l) of $total packages, now $(echo "$files" | tail -n 1 | sed 's/^ *[A-Z][a-z ]* //'), $1 s"
    else
        say "looking up: $(grep -c '^Collecting' .venv/pip.out || :) of $total packages, $1 s"
    fi
}

with_uv() { # installs, and shows uv's own progress; fails where there is no uv
    uv --version >/dev/null 2>&1 || return 1
    uv pip install --python .venv/bin/python --no-deps --compile-bytecode "$@" >&2 && return 0
    say "uv could not install this (its message is above): going on with pip"
    return 1
}

with_pip() { # installs; without a terminal, where pip shows no bar, says now and then how far it is
    pip_install=".venv/bin/python -m pip --disable-pip-version-check install --no-deps"
    if [ -t 1 ]; then
        $pip_install "$@" 2>.venv/pip.log
        return
    fi
    $pip_install "$@" >.venv/pip.out 2>.venv/pip.log &
    pip=$!
    trap 'kill $pip; exit 130' INT
    trap 'kill $pip; exit 143' TERM
    seconds=0
    while kill -0 $pip 2>/dev/null; do
        sleep 1
        seconds=$((seconds + 1))
        [ $((seconds % 15)) != 0 ] || progress $seconds
    done
    trap - INT TERM
    wait $pip
}

install() { with_uv "$@" || with_pip "$@"; }

python_packages() {
    [ -n "$needed" ] || return 0
    rm -f .venv/ready
    if [ "${have% * * *}" != "$PWD" ]; then
        "$python" -m venv --clear .venv || fail "$python could not make .venv: see its message above."
    fi
    pins >.venv/pins.txt
    if ! install --require-hashes -r .venv/pins.txt; then
        ! grep -q 'connection broken' .venv/pip.log || fail "the package index cannot be reached:" \
            "check the network connection (or the proxy) and call make again."
        grep ^ERROR .venv/pip.log >&2 || cat .venv/pip.log >&2
        fail "pip could not install the pinned packages: see its message above, then call make again."
    fi
    if ! install --no-build-isolation -e .; then
        cat .venv/pip.log >&2
        fail "pip could not install focalgradient itself: see its message above."
    fi
    echo "$want" >.venv/ready
}

page() { # the page for browsers: nothing is done while it is made of its present sources
    .venv/bin/python hatch_build.py || say "the page for browsers was not bundled (deno's message is above):" \
        "'focalgradient serve' needs it"
}

python_wanted
debian_packages
python_packages
page
[ "$purpose" != setup ] || say "all is there: make reproduce or .venv/bin/focalgradient; make test adds PsychoPy and the tools of the tests"
