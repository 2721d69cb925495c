"""Makes zig.exe run under Wine 8, which real Windows does not need: zig.py FOLDER

In FOLDER, zig.exe gets ntdlx.dll (ntdlx.c) in place of ntdll.dll, and its sections lie in the file as in memory: Wine
reads a program of 190 MB whole each time that it begins, unless it can map it.
"""

import re
import struct
import subprocess
import sys
from pathlib import Path

PAGE = 4096
OWN = {
    "NtLockFile": "lock_file",
    "NtUnlockFile": "unlock_file",
    "NtSetInformationFile": "set_file",
    "NtQueryAttributesFile": "query_file",
}


def mapped(program: bytes) -> bytes:
    """The same program with all sections at whole pages of the file."""
    header = struct.unpack_from("<I", program, 0x3C)[0]
    sections, size_of_optional = struct.unpack_from("<H", program, header + 6)[0], struct.unpack_from("<H", program, header + 20)[0]
    optional = header + 24
    out = bytearray(program[: struct.unpack_from("<I", program, optional + 60)[0]])

    def fill() -> None:
        out.extend(bytes(-len(out) % PAGE))

    fill()
    struct.pack_into("<I", out, optional + 36, PAGE)
    struct.pack_into("<I", out, optional + 60, len(out))
    for number in range(sections):
        place = optional + size_of_optional + 40 * number + 16
        size, begin = struct.unpack_from("<II", program, place)
        if size:
            now = len(out)
            out += program[begin : begin + size]
            fill()
            struct.pack_into("<II", out, place, len(out) - now, now)
    return bytes(out)


def main(folder: Path) -> None:
    zig = folder / "zig.exe"
    listing = subprocess.run(["x86_64-w64-mingw32-objdump", "-p", zig], capture_output=True, text=True, check=True).stdout
    imports = re.search(r"DLL Name: ntdll\.dll\n(.*?)\n\n", listing, re.DOTALL)[1]
    names = re.findall(r"\s((?:Nt|Rtl|Ldr)\w+)$", imports, re.MULTILINE)
    lines = [f"{name} = {OWN.get(name, 'ntdll.' + name)}" for name in names]
    exports = folder / "ntdlx.def"
    exports.write_text("LIBRARY ntdlx.dll\nEXPORTS\n" + "\n".join(lines) + "\n")
    source = Path(__file__).with_name("ntdlx.c")
    subprocess.run(
        ["x86_64-w64-mingw32-gcc", "-nostdlib", "-shared", "-Wl,-e,0", "-o", folder / "ntdlx.dll", source, exports, "-lntdll"],
        check=True,
    )
    zig.write_bytes(mapped(zig.read_bytes().replace(b"ntdll.dll\0", b"ntdlx.dll\0")))


main(Path(sys.argv[1]))
