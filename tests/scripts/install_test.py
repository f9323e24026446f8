#!/usr/bin/python3
"""An installation in a temporary folder, moved after it was made: the program runs from anywhere and finds its Python
package, C++ programs find the libraries, the manual and the completion say what --help says, and nothing refers to where
it was built.

usage: install_test.py BUILD CMAKE
"""

import gzip
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

SOURCE = pathlib.Path(__file__).resolve().parents[2]
CMAKE, BUILD = sys.argv.pop(2), pathlib.Path(sys.argv.pop(1)).resolve()
SMALL = ["target.samples=4", "samples.primal=4", "samples.interior=4", "samples.visibility=4", "resolution=[8, 8]"]


def run(*command, **options):
    result = subprocess.run([str(c) for c in command], capture_output=True, text=True, check=False, **options)
    if result.returncode != 0:
        raise AssertionError(f"{command} failed:\n{result.stdout}{result.stderr}")
    return result


class InstallTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        run(CMAKE, "--install", BUILD, "--prefix", cls.folder / "first")
        cls.prefix = (cls.folder / "first").rename(cls.folder / "a place")
        cls.program = cls.prefix / "bin/isochron"
        cls.share = cls.prefix / "share/isochron"
        cls.commands = re.findall(r"^  ([a-z]+) ", cls.help().partition("Subcommands:")[2].partition("\n\n")[0], re.M)

    @classmethod
    def help(cls, *command):
        return run(cls.program, *command, "--help").stdout

    def scratch(self):
        return pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))

    def test_runs_from_anywhere(self):
        settings = [part for setting in [*SMALL, "optimizer.iterations=1"] for part in ("--set", setting)]
        folder = self.scratch()
        run(self.program, "run", self.share / "experiments/cube.yaml", *settings, cwd=folder)
        names = {path.name for path in (folder / "runs/cube").iterdir()}
        self.assertLessEqual({"final.exr", "final.png", "report.html", "rmse.png", "summary.yaml"}, names)
        (folder / "runs/cube/final.png").unlink()
        run(self.program, "plot", "runs/cube", cwd=folder)
        self.assertTrue((folder / "runs/cube/final.png").exists())

    def test_ranks(self):
        if not (BUILD / "isochron_mpi.so").exists():
            self.skipTest("built without MPI")
        root = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}  # as in containers
        folder = self.scratch()
        run("mpirun", "--oversubscribe", "--bind-to", "none", "-n", "2", self.program, "render", "--samples", "4", "-o", folder,
            self.share / "experiments/cube.yaml", env={**os.environ, **root}, cwd=folder)
        self.assertTrue((folder / "render.exr").exists())

    def test_its_own_python_package(self):
        packages = self.prefix / "lib/python3/dist-packages"
        where = "import isochron.plot; print(isochron.plot.__file__)"
        found = run(sys.executable, "-c", where, env={"PYTHONPATH": str(packages)}, cwd=self.folder).stdout
        self.assertEqual(pathlib.Path(found.strip()), packages / "isochron/plot.py")
        for path in BUILD.glob("python/isochron/_core*.so"):
            self.assertTrue((packages / "isochron" / path.name).exists())
            run(sys.executable, "-c", "import isochron; isochron.Experiment('cube.yaml').render(samples=2)",
                env={"PYTHONPATH": str(packages)}, cwd=self.share / "experiments")
        # The program looks nowhere else: without the package there are no pictures.
        (packages / "isochron").rename(packages / "hidden")
        try:
            folder = self.scratch()
            (folder / "log.csv").touch()
            result = subprocess.run([self.program, "plot", folder], capture_output=True, text=True, check=False)
            self.assertRegex(result.stderr, "No module named '?isochron")
        finally:
            (packages / "hidden").rename(packages / "isochron")

    def test_scripts(self):
        for script in sorted((self.share / "scripts").glob("import_*.py")):
            self.assertIn("usage:", run(sys.executable, script, "--help", env={}, cwd=self.folder).stdout)

    def test_cpp(self):
        build, out = self.scratch(), self.scratch()
        # Without the flags of the environment: those that are found are the package's own.
        run(CMAKE, "-S", self.share / "examples/cpp", "-B", build, f"-DCMAKE_PREFIX_PATH={self.prefix}",
            "-DCMAKE_EXPORT_COMPILE_COMMANDS=ON", "-DCMAKE_CXX_FLAGS=")
        commands = (build / "compile_commands.json").read_text()
        for option in ("-march", "-W", "-fno-", str(SOURCE)):
            self.assertNotIn(option, commands)
        run(CMAKE, "--build", build)
        text = run(build / "render", self.share / "scenes/cube/scene.yaml", "cube", cwd=out).stdout
        means = [float(x) for x in re.findall(r"mean ([\d.]+)", text)]
        self.assertEqual(len(means), 3)
        self.assertGreater(min(means), 0)
        self.assertTrue((out / "images.exr").exists())
        settings = [*SMALL, "optimizer.iterations=2"]
        text = run(build / "optimise", self.share / "experiments/cube.yaml", "run", *settings, cwd=out).stdout
        self.assertRegex(text, r"iteration 2: .*\niterations_reached\n")
        self.assertTrue((out / "run/final.exr").exists())

    def configure(self, *lines):
        """CMake's exit status and messages on a project that looks for isochron."""
        folder = self.scratch()
        (folder / "x.cpp").write_text("int main() {}")
        (folder / "CMakeLists.txt").write_text("\n".join(["cmake_minimum_required(VERSION 3.25)", "project(x CXX)", *lines]))
        command = [CMAKE, "-S", folder, "-B", folder / "build", f"-DCMAKE_PREFIX_PATH={self.prefix}"]
        result = subprocess.run(command, capture_output=True, text=True, check=False)
        return result.returncode, " ".join(result.stderr.split())

    def test_components(self):
        core_alone = ["find_package(isochron 0.3 REQUIRED)", "add_executable(x x.cpp)", "target_link_libraries(x isochron::core)"]
        self.assertEqual(self.configure(*core_alone), (0, ""))
        status, errors = self.configure("find_package(isochron REQUIRED COMPONENTS rendering)")
        self.assertNotEqual(status, 0)
        self.assertIn("isochron has no component rendering (allowed: core, optim)", errors)

    def test_manual(self):
        self.assertIn("run", self.commands)
        folder = self.prefix / "share/man/man1"
        pages = {path.name: path for path in folder.iterdir()}
        self.assertEqual(sorted(pages), sorted(["isochron.1.gz", *(f"isochron-{c}.1.gz" for c in self.commands)]))
        for path in pages.values():
            with self.subTest(path.name):
                text = self.scratch() / path.name.removesuffix(".gz")
                text.write_bytes(gzip.decompress(path.read_bytes()))
                environment = {**os.environ, "LC_ALL": "C.UTF-8", "MANWIDTH": "80"}
                page = run("man", "--warnings", "--no-hyphenation", "-E", "ascii", "-l", text, env=environment)
                self.assertEqual(page.stderr, "")
                shown = " ".join(page.stdout.split())
                command = path.name.removesuffix(".1.gz").split("-")[1:]
                for words in self.help_words(*command):
                    self.assertIn(words, shown)

    def help_words(self, *command):
        """Names of options and descriptions, examples included, without the layout of --help."""
        for line in self.help(*command).splitlines():
            head, _, text = line.strip().partition("  ")
            if line.startswith("  -"):
                yield from re.findall(r"-[\w-]+", head.split()[0])
            elif line.startswith("  isochron "):
                yield head
            if text or line.startswith("    "):
                yield text.strip() or head

    def complete(self, *words):
        script = self.prefix / "share/bash-completion/completions/isochron"
        lines = ['source "$1"; shift; complete -p isochron >/dev/null || exit 1',
                 'COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _isochron 2>/dev/null; printf "%s\\n" "${COMPREPLY[@]}"']
        shell = ["bash", "--norc", "-uc", "\n".join(lines), "bash", script, self.program, *words]
        return run(*shell, cwd=self.share).stdout.splitlines()

    def test_completion(self):
        self.assertEqual(self.complete(""), self.commands)
        self.assertEqual(self.complete("ru"), ["run"])
        for command in self.commands:
            options = re.findall(r"^  (?:-\w,)?(--[\w-]+)", self.help(command), re.M)
            self.assertEqual(self.complete(command, "--"), options)
        self.assertEqual(self.complete("run", "x.yaml", "--at", ""), ["initial", "target"])
        self.assertEqual(self.complete("run", "x.yaml", "--at", "=", "t"), ["target"])
        self.assertEqual(sorted(self.complete("run", "x.yaml", "-o", "sc")), ["scenes", "scripts"])
        self.assertEqual(self.complete("run", "--samples", ""), [""])
        self.assertEqual(self.complete("run", "--quiet", "experiments/lett"), ["experiments/letter.yaml"])
        self.assertEqual(self.complete("run", "scenes/letter/board"), [""])
        self.assertEqual(self.complete("resume", "exp"), ["experiments"])
        self.assertEqual(self.complete("nonsense", ""), [""])

    def test_nothing_of_the_build(self):
        for path in self.prefix.rglob("*"):
            self.assertFalse(path.is_symlink(), path)
            if path.is_file() and path.suffix != ".pyc":  # these are made by Python when it runs
                contents = gzip.decompress(path.read_bytes()) if path.suffix == ".gz" else path.read_bytes()
                for folder in (SOURCE, BUILD, self.folder):
                    self.assertFalse(os.fsencode(f"{folder}/") in contents, f"{path} has {folder}")
        self.assertNotRegex(run("readelf", "-d", self.program).stdout, "R(UN)?PATH")


if __name__ == "__main__":
    unittest.main()
