# shellcheck shell=bash
# The first part of .ci/windows and .ci/windows-c, which set `targets`: finds Wine and MinGW-w64, or installs them where
# that is possible, and makes Wine's disk C in target/wine. Sets wine, windows (a folder) and scratch.

missing() {
    echo "nothing was run for Windows: $1" >&2
    exit 1
}

# Where Debian has Wine's server, if only its program for 64 bits is installed.
PATH=$PATH:/usr/lib/wine
# Debian's `wine` takes the program for 32 bits where both are there.
find_wine() {
    for wine in /usr/lib/wine/wine64 wine64 wine; do
        if wine=$(command -v "$wine"); then return; fi
    done
    return 1
}
compilers() {
    command -v x86_64-w64-mingw32-gcc && command -v i686-w64-mingw32-gcc
}
if ! { find_wine && compilers; } >/dev/null; then
    {
        # Where a list of packages can't be had, the others may do.
        dpkg --add-architecture i386
        apt-get update
        apt-get install -y --no-install-recommends wine wine64 gcc-mingw-w64-x86-64 gcc-mingw-w64-i686
        apt-get install -y --no-install-recommends wine32:i386
    } >/dev/null 2>&1 || true
fi
find_wine || missing "there is no Wine (Debian: wine64)"
compilers >/dev/null || missing "there is no MinGW-w64 (Debian: gcc-mingw-w64-x86-64 and gcc-mingw-w64-i686)"
export WINEPREFIX=$PWD/target/wine
scratch=$(mktemp -d)
# Whatever was left running ends with Wine's server.
trap 'wineserver -k 2>/dev/null || true; rm -rf "$scratch"' EXIT
# shellcheck disable=SC2154
for each in "${targets[@]}"; do
    [ -d "$(rustc --print target-libdir --target "$each")" ] || rustup target add "$each" >/dev/null 2>"$scratch/rustup" \
        || missing "rustup can't add the target $each: $(grep -m1 ^error: "$scratch/rustup")"
done

# Names of files are only right in UTF-8. Wine asks for nothing, shows nothing and starts no debugger.
export LC_ALL=C.UTF-8 WINEDEBUG=-all WINEDLLOVERRIDES="mscoree=;mshtml=;winedbg.exe=" WINELOADER=$wine
unset DISPLAY
windows=$WINEPREFIX/drive_c/windows

# Rust's programs take their random numbers from a library that Wine 8 does not have: random_library FOLDER COMPILER
random_library() {
    [ ! -e "$windows/$1/bcryptprimitives.dll" ] || return 0
    cat >"$scratch/random.c" <<'END'
#include <windows.h>
BOOLEAN NTAPI SystemFunction036(void *data, ULONG size);
__declspec(dllexport) BOOL WINAPI ProcessPrng(BYTE *data, SIZE_T size) { return SystemFunction036(data, (ULONG) size); }
END
    "$2" -shared -Wl,--kill-at -o "$windows/$1/bcryptprimitives.dll" "$scratch/random.c" -ladvapi32
}

# Debian's libraries for programs of 32 bits, which Wine's program for 64 bits runs. Where their package can't be
# installed, because other libraries are there in newer versions for 64 bits only, its files are enough.
for_32=/usr/lib/i386-linux-gnu/wine/i386-windows
get_32() {
    export WINEDLLPATH=$PWD/target/wine32
    for_32=$WINEDLLPATH/i386-windows
    [ ! -e "$WINEDLLPATH/made" ] || return 0
    rm -rf "$WINEDLLPATH"
    mkdir -p "$WINEDLLPATH"
    # Wine looks for the other half of a library, the one for Linux, beside its folder.
    ln -s /usr/lib/x86_64-linux-gnu/wine/x86_64-unix "$WINEDLLPATH"
    # shellcheck disable=SC2016
    (cd "$scratch" && apt-get download "libwine:i386=$(dpkg-query --show --showformat '${Version}' libwine:amd64)") \
        && dpkg-deb --fsys-tarfile "$scratch"/libwine_*.deb \
        | tar x -C "$WINEDLLPATH" --strip-components 5 ./usr/lib/i386-linux-gnu/wine/i386-windows \
        && touch "$WINEDLLPATH/made"
}
case " ${targets[*]} " in
    *" i686-"*) [ -e "$for_32/kernel32.dll" ] || get_32 >/dev/null 2>&1 || true ;;
esac

# A disk that was not finished has no mark.
if [ ! -e "$WINEPREFIX/made" ]; then
    rm -rf "$WINEPREFIX"
    mkdir -p "$WINEPREFIX"
    timeout 300 "$wine" wineboot --init >"$scratch/boot" 2>&1 \
        || missing "Wine can't make a disk in $WINEPREFIX: $(tail -1 "$scratch/boot")"
    wineserver -w
    random_library system32 x86_64-w64-mingw32-gcc
    touch "$WINEPREFIX/made"
fi
# The program for 64 bits leaves the folder for 32 bits empty, also when the files for it are there.
if [ ! -e "$windows/syswow64/kernel32.dll" ] && [ -e "$for_32/kernel32.dll" ]; then
    mkdir -p "$windows/syswow64"
    # A part of Debian's package libz-mingw-w64.
    cp -L /usr/i686-w64-mingw32/lib/zlib1.dll "$windows/syswow64" || true
    cp "$for_32"/*.{dll,exe} "$windows/syswow64"
fi
[ ! -e "$windows/syswow64/kernel32.dll" ] || random_library syswow64 i686-w64-mingw32-gcc
