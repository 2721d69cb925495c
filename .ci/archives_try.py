"""Tries an archive as a user does: unpacked in an empty folder, without Rust and without a compiler in the path."""

import os
import platform
import re
import shutil
import subprocess
import sys
import tempfile
import time
import urllib.request
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
QEMU = {
    "linux-aarch64": ["qemu-aarch64", "-L", "/usr/aarch64-linux-gnu"],
    "linux-armv7": ["qemu-arm", "-L", "/usr/arm-linux-gnueabihf"],
}
LIMIT = 120
# The newest C library that the programs for Linux may need.
GLIBC = (2, 17)


def runner(system: str) -> list[str] | None:
    """What runs a program of this system here, or `None`."""
    if system in QEMU:
        emulator, *libraries = QEMU[system]
        place = shutil.which(emulator)
        return [place, *libraries] if place and Path(libraries[1]).is_dir() else None
    if system == "windows-x86_64":
        # Made by `.ci/windows`.
        wine = next(filter(None, map(shutil.which, ["/usr/lib/wine/wine64", "wine64", "wine"])), None)
        return [wine] if wine and (ROOT / "target/wine/made").exists() else None
    here = {"Linux": "linux", "Darwin": "macos"}.get(platform.system())
    return [] if system == f"{here}-{platform.machine()}" else None


def environment(scratch: Path) -> dict[str, str]:
    kept = dict(PATH="/nowhere", HOME=str(scratch), TMPDIR=str(scratch), LC_ALL="C.UTF-8", WINEDEBUG="-all")
    return dict(kept, WINEPREFIX=str(ROOT / "target/wine"), WINEDLLOVERRIDES="mscoree=;mshtml=")


class Unpacked:
    """An unpacked archive, and how its programs are started."""

    def __init__(self, archive: Path, system: str, run: list[str], scratch: Path):
        # A name as people have it.
        place = scratch / "Schüler 1"
        place.mkdir()
        if archive.suffix == ".zip":
            zipfile.ZipFile(archive).extractall(place)
        else:
            subprocess.run(["tar", "--extract", "--file", archive, "--directory", place], check=True)
        (self.folder,) = place.iterdir()
        self.ending = ".exe" if system.startswith("windows") else ""
        self.run, self.scratch, self.environment = run, scratch, environment(scratch)

    def command(self, program: str, *arguments: str) -> list[str]:
        return [*self.run, str(self.folder / (program + self.ending)), *arguments]

    def output(self, program: str, *arguments: str, **more: str) -> str:
        done = subprocess.run(self.command(program, *arguments), env=dict(self.environment, **more), text=True,
                              stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                              timeout=LIMIT, cwd=self.folder)
        assert done.returncode == 0, f"{program} {' '.join(arguments)}: {done.returncode}\n{done.stdout}"
        return done.stdout

    def serving(self, *arguments: str) -> tuple[subprocess.Popen, str]:
        """Starts `txt` and waits for what it says of where it is."""
        said = self.scratch / arguments[0]
        with said.open("w") as out:
            process = subprocess.Popen(self.command("txt", *arguments), env=self.environment, cwd=self.folder,
                                       stdin=subprocess.DEVNULL, stdout=out, stderr=subprocess.STDOUT)
        end = time.monotonic() + LIMIT
        while not (found := re.search(r"(127\.0\.0\.1:\d+\S*)", said.read_text())):
            assert process.poll() is None and time.monotonic() < end, said.read_text()
            time.sleep(0.1)
        return process, found[1]


def glibc(folder: Path) -> str:
    """The newest C library that a file of the folder needs."""
    files = [path for path in folder.iterdir() if path.is_file()]
    found = [version for path in files for version in re.findall(rb"GLIBC_(\d+)\.(\d+)", path.read_bytes())]
    newest = max(tuple(map(int, version)) for version in found)
    assert newest <= GLIBC, f"glibc {newest} is needed"
    return "glibc %d.%d" % newest


def steps(unpacked: Unpacked, system: str) -> list[str]:
    """Does what a user does, and says what was done."""
    done = []
    if system.startswith("linux"):
        done.append(glibc(unpacked.folder))
    assert "usage: tx_run" in unpacked.output("tx_run", "--help")
    starter = {"windows": ["txt-start.cmd"], "macos": ["txt-start.command"]}.get(system.split("-")[0], [])
    for path in [*starter, "completions/txt.bash", "completions/_txt", "completions/txt.fish",
                 "completions/_txt.ps1", "man/txt.1", "man/txt-panel.1", "c/include/ftMscLib.h", "docs/txt.md",
                 "LICENSE-MIT", "LICENSE-uPlot"]:
        assert (unpacked.folder / path).stat().st_size > 0, path
    served = []
    try:
        simulated, address = unpacked.serving("simulate", "--port", "0")
        served.append(simulated)
        assert address in unpacked.output("txt", "find", "--only", address)
        recording = unpacked.folder / "run.mcap"
        unpacked.output("txt", "record", address, "--seconds", "2", "--output", recording.name)
        assert "cycles" in unpacked.output("txt", "info", recording.name)
        done.append("txt simulate, find, record, info")
        panel, address = unpacked.serving("panel", "--no-browser")
        served.append(panel)
        page = urllib.request.urlopen(f"http://{address}", timeout=LIMIT).read()
        assert b"<html" in page, page[:200]
        done.append("panel")
    finally:
        for process in served:
            process.terminate()
            process.wait(LIMIT)
        if system.startswith("windows"):
            # It stays for a moment, with services of Windows.
            subprocess.run(["wineserver", "-k"], env=dict(unpacked.environment, PATH=os.environ["PATH"]))
    if not unpacked.run and (cc := shutil.which("cc")):
        world = unpacked.folder / "c/examples/gate.toml"
        unpacked.output("tx_run", "c/examples/gate.c", "--world", str(world), CC=cc, PATH=os.environ["PATH"])
        done.append("tx_run with a C program")
    return done


def try_archive(archive: Path, system: str) -> int:
    run = runner(system)
    if run is None:
        return keep(system, "ignored", "nothing here runs its programs")
    with tempfile.TemporaryDirectory() as scratch:
        try:
            how, text = "passed", ", ".join(steps(Unpacked(archive, system, run, Path(scratch)), system))
        except (AssertionError, OSError, subprocess.SubprocessError) as error:
            print(error)
            how, text = "failed", str(error).splitlines()[0]
    return keep(system, how, text)


def keep(system: str, how: str, text: str) -> int:
    """Says what came out, and keeps it for docs/systems.md."""
    print(f"{how}: {text}", flush=True)
    names = {"linux-x86_64": "Linux x86_64", "linux-aarch64": "Linux aarch64 (qemu)", "linux-armv7": "Linux armv7 (qemu)",
             "windows-x86_64": "Windows x86_64"}
    results = [sys.executable, ROOT / ".ci/results", "note", names.get(system, system), "archive, unpacked"]
    return subprocess.run([*results, how, text]).returncode
