# shellcheck shell=bash
# Makes and updates the virtual environment in .venv; scripts/fit and scripts/test source this file.

root="$(CDPATH='' cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." >/dev/null && pwd -P)"
environment="$root/.venv"
stamp="$environment/bowdenfit.stamp"

# A robot workspace often puts packages of its own here, which would hide the pinned ones.
unset PYTHONPATH PYTHONHOME
# Where byte code is not kept, as in many containers, each process compiles all of JAX anew: 9 s of CPU instead of 3.
unset PYTHONDONTWRITEBYTECODE
# Some machines have pip install for the user by default, which it refuses to do inside an environment.
export PIP_USER=0
# Hard links from uv's cache fail with a warning when the cache lies on another file system.
export UV_LINK_MODE="${UV_LINK_MODE:-copy}"
export UV_PYTHON_DOWNLOADS=never

say() {
    printf 'bowdenfit: %s\n' "$*" >&2
}

fail() {
    say "$@"
    exit 1
}

# A version manager leaves commands on the PATH that fail when run, so having one is not enough.
have_uv() {
    uv --version >/dev/null 2>&1 </dev/null
}

# Prints three lines: where the Python is installed, its version, and its own executable rather than
# that of an environment. The last matters when .venv itself is active and about to be made again.
describe_python() {
    "$1" -I -S -c '
import sys
if sys.version_info < (3, 11) or sys.implementation.name != "cpython":
    sys.exit(1)
if "venv" in sys.argv[1:]:
    import ensurepip, venv
print(sys.base_prefix)
print("%d.%d" % sys.version_info[:2])
print(getattr(sys, "_base_executable", None) or sys.executable)
' ${2+"$2"} 2>/dev/null </dev/null
}

# Without uv the Python must be able to make environments itself.
describe_usable_python() {
    if [ "$installer" = uv ]; then
        describe_python "$1"
    else
        describe_python "$1" venv
    fi
}

find_python() {
    local name path
    if [ -n "${BOWDENFIT_PYTHON:-}" ]; then
        describe_usable_python "$BOWDENFIT_PYTHON" && return
        if describe_python "$BOWDENFIT_PYTHON" >/dev/null; then
            fail "BOWDENFIT_PYTHON names $BOWDENFIT_PYTHON, which lacks the modules venv and ensurepip." \
                "Install uv or the package python3-venv, or name another Python."
        fi
        fail "BOWDENFIT_PYTHON names $BOWDENFIT_PYTHON, which is not a working Python 3.11 or newer." \
            "Name another one, or unset the variable to have one looked for."
    fi
    for name in python3.14 python3.13 python3.12 python3.11 python3 python; do
        while IFS= read -r path; do
            describe_usable_python "$path" && return
        done < <(type -aP "$name")
    done
    if [ "$installer" = uv ] && path="$(uv python find --no-project '>=3.11' 2>/dev/null </dev/null)"; then
        describe_usable_python "$path" && return
    fi
    for name in python3.14 python3.13 python3.12 python3.11 python3 python; do
        while IFS= read -r path; do
            if describe_python "$path" >/dev/null; then
                fail "$path lacks the modules venv and ensurepip. Install uv, or on Debian and Ubuntu" \
                    "the package python3-venv, and run this again."
            fi
        done < <(type -aP "$name")
    done
    fail "no working Python 3.11 or newer was found on the PATH." \
        "Install one, or name it in the variable BOWDENFIT_PYTHON, and run this again."
}

requirements_checksum() {
    cat "$root/pyproject.toml" "$root/constraints.txt" | cksum
}

# An environment holds absolute paths and belongs to one Python, so it cannot be used after a move.
place_of() {
    local description
    description="$(describe_python "$1")" || return 1
    printf '%s\n' "$root $(printf '%s\n' "$description" | sed -n '1,2p' | tr '\n' ' ')"
}

# Sets state to one of
#   ready     nothing to do
#   outdated  the packages must be brought up to date
#   unusable  the environment must be made again
#   absent    there is none
#   foreign   something else made it
inspect_environment() {
    local wanted="$1" place='' stamped_checksum=''
    stamped_extra=''
    stamped_place=''
    if [ ! -e "$stamp" ]; then
        state=absent
        if [ -n "$(find "$environment" -mindepth 1 -maxdepth 1 ! -name "${stamp##*/}*" 2>/dev/null)" ]; then
            state=foreign
        fi
        return
    fi
    {
        IFS= read -r stamped_place || true
        IFS= read -r stamped_checksum || true
        IFS= read -r stamped_extra || true
    } <"$stamp"
    state=unusable
    if [ "$stamped_place" = unfinished ]; then return; fi
    place="$(place_of "$environment/bin/python")" || return 0
    if [ "$place" != "$stamped_place" ]; then return; fi
    if [ -n "${BOWDENFIT_PYTHON:-}" ] && [ "$(place_of "$BOWDENFIT_PYTHON")" != "$place" ]; then return; fi
    state=outdated
    if [ "$stamped_checksum" != "$(requirements_checksum)" ]; then return; fi
    if [ "$wanted" = test ] && [ "$stamped_extra" != test ]; then return; fi
    state=ready
}

write_stamp() {
    printf '%s\n' "$@" >"$stamp.new"
    mv -f "$stamp.new" "$stamp"
}

# The stamp stays while the rest goes, so that an interruption here is seen as one.
empty_environment() {
    find "$environment" -mindepth 1 -maxdepth 1 ! -name "${stamp##*/}" -exec rm -rf {} +
}

install_packages() {
    local what="$1" quiet='--quiet'
    # Someone who waits at a terminal sees the progress; a log gets the errors alone.
    if [ -t 2 ]; then quiet=''; fi
    # Relative names, because pip splits the values of its variables at spaces.
    cd "$root" || return 1
    if [ "$installer" = uv ]; then
        uv pip install ${quiet:+"$quiet"} --python "$environment/bin/python" \
            -c constraints.txt -b constraints.txt -e "$what" >&2 </dev/null
    else
        # Older versions of pip pin the build with the first variable, newer ones with the second. Half of the time would be
        # spent on the byte code of modules that are never loaded; the others get it once they are.
        PIP_CONSTRAINT=constraints.txt PIP_BUILD_CONSTRAINT=constraints.txt \
            "$environment/bin/python" -m pip install ${quiet:+"$quiet" "$quiet"} --no-compile \
            --no-input --disable-pip-version-check \
            -e "$what" >&2 </dev/null
    fi
}

create_environment() {
    if [ "$installer" = uv ]; then
        uv venv --quiet --no-project --allow-existing --python "$1" "$environment" >&2 </dev/null
    else
        "$1" -m venv "$environment" >&2 </dev/null
    fi
}

make_environment() {
    local wanted="$1" what=. description version executable checksum started=$SECONDS previous=''
    # What the tests need stays when a fit brings the environment up to date.
    if [ "$stamped_extra" = test ]; then wanted='test'; fi
    if [ "$wanted" = test ]; then what='.[test]'; fi
    installer=pip
    if have_uv; then installer=uv; fi
    # uv leaves pip out of what it makes.
    if [ "$state" = outdated ] && [ "$installer" = pip ] && [ ! -e "$environment/bin/pip" ]; then
        state=unusable
    fi
    # Taken first, so that a change to the files during the installation is seen at the next start.
    checksum="$(requirements_checksum)"

    if [ "$state" = outdated ]; then
        previous="$(cat "$stamp")"
        say "bringing the packages in $environment up to date with $installer."
        write_stamp unfinished
    else
        description="$(find_python)" || exit 1
        version="$(printf '%s\n' "$description" | sed -n 2p)"
        executable="$(printf '%s\n' "$description" | sed -n 3p)"
        if [ "$state" = unusable ]; then
            if [ "$stamped_place" = unfinished ]; then
                say "the environment in $environment was left unfinished."
            else
                say "the environment in $environment is for another place, Python or installer."
            fi
        fi
        say "making an environment in $environment with Python $version ($executable) and $installer." \
            "This takes about a minute and is done once."
        mkdir -p "$environment" || fail "the folder $root must be writable to make the environment."
        write_stamp unfinished
        empty_environment
        create_environment "$executable" ||
            fail "the environment could not be made; the messages above say why." \
                "Name another Python in the variable BOWDENFIT_PYTHON, or free some space, and run this again."
    fi

    if ! (install_packages "$what"); then
        # Both installers find and fetch all packages before they change any, so the old ones still work.
        if [ -n "$previous" ]; then write_stamp "$previous"; fi
        fail "the packages could not be installed; the messages above say why." \
            "If the package index could not be reached, connect to the network and run this again."
    fi
    write_stamp "$(place_of "$environment/bin/python")" "$checksum" "$wanted"
    say "the environment is ready after $((SECONDS - started)) s."
}

# Brings .venv to what is asked for, "runtime" or "test".
prepare_environment() {
    inspect_environment "$1"
    if [ "$state" = ready ]; then return; fi

    # The lock is on the folder, which leaves no file behind; where it cannot be had, go on without.
    exec 9<"$root"
    if command -v flock >/dev/null 2>&1 && ! flock -n 9 2>/dev/null; then
        say "waiting for another process that prepares the environment."
        flock 9 2>/dev/null || true
    fi
    # An installer that was interrupted may report an ordinary failure, which must not restore the stamp.
    trap 'exit 130' INT
    trap 'exit 143' TERM
    inspect_environment "$1"
    case "$state" in
        ready) ;;
        foreign) fail "$environment was not made by this script. Move or delete it and run this again." ;;
        *) make_environment "$1" ;;
    esac
    trap - INT TERM
    exec 9<&-
}
