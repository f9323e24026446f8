#!/usr/bin/python3
"""Reports of small runs in headless Chromium: nothing on its console, nothing loaded, pictures, sliders and keys that work.

usage: report_browser_test.py PROGRAM FOLDER     screenshots are left in FOLDER
"""

import base64
import io
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time
import unittest

MISSING = 77  # the status by which a test says that it was left out
try:
    from selenium import webdriver
    from selenium.webdriver.chrome.options import Options
    from selenium.webdriver.chrome.service import Service
    from selenium.webdriver.common.by import By
    from selenium.webdriver.common.keys import Keys
except ImportError:
    webdriver = None

import numpy as np
from PIL import Image
from report_folders import write_reconstruction
from isochron.report.__main__ import main as write_report

ROOT = pathlib.Path(__file__).resolve().parents[2]
DRIVER = shutil.which("chromedriver")
EXPERIMENTS = {
    "cube": ["optimizer.iterations=5"],
    "letter": ["optimizer.iterations=1", "optimizer.inner_iterations=2", "target.samples=256",
               "output.histogram_samples=256", "samples={primal: 16, interior: 16, visibility: 0, path_length: 0}"],
}


def open_browser():
    options = Options()
    for argument in ("--headless=new", "--disable-gpu", "--disable-dev-shm-usage", "--disable-background-networking",
                     "--no-first-run", "--disable-component-update", "--force-color-profile=srgb",
                     "--window-size=1280,1000"):
        options.add_argument(argument)
    if os.geteuid() == 0:
        options.add_argument("--no-sandbox")  # which Chromium asks of root
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    return webdriver.Chrome(service=Service(DRIVER), options=options)


def contrast(one, other):
    """Ratio of luminances of two colours, as WCAG defines it."""
    def luminance(colour):
        unit = np.array([int(v) for v in re.findall(r"\d+", colour)[:3]]) / 255
        return np.where(unit <= 0.04045, unit / 12.92, ((unit + 0.055) / 1.055) ** 2.4) @ [0.2126, 0.7152, 0.0722]
    light, dark = sorted((luminance(one), luminance(other)), reverse=True)
    return (light + 0.05) / (dark + 0.05)


class BrowserTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.runs = {}
        for name, changes in EXPERIMENTS.items():
            out = pathlib.Path(folder.name) / name
            cls.runs[name] = out / "report.html"
            changes = [word for change in changes for word in ("--set", change)]
            subprocess.run([PROGRAM, "run", ROOT / f"experiments/{name}.yaml", "-o", out, "--quiet", *changes], check=True,
                           stdout=subprocess.DEVNULL)
        cls.runs["comparison"] = pathlib.Path(folder.name) / "comparison.html"
        folders = [cls.runs[name].parent for name in EXPERIMENTS]
        subprocess.run([PROGRAM, "report", *folders, "-o", cls.runs["comparison"], "--quiet"], check=True)
        cls.runs["reconstruction"] = pathlib.Path(folder.name) / "reconstruction/report.html"
        write_report([str(write_reconstruction(cls.runs["reconstruction"].parent))])
        cls.browser = open_browser()
        cls.addClassCleanup(cls.browser.quit)

    def command(self, name, **arguments):
        return self.browser.execute_cdp_cmd(name, arguments)

    def script(self, code, *arguments):
        return self.browser.execute_script(code, *arguments)

    def find(self, selector):
        return self.browser.find_elements(By.CSS_SELECTOR, selector)

    def open(self, name, scheme="light", media="", width=1280):
        # Without motion, so that what is clicked has arrived.
        self.command("Emulation.setEmulatedMedia", media=media, features=[
            {"name": "prefers-color-scheme", "value": scheme}, {"name": "prefers-reduced-motion", "value": "reduce"}])
        self.command("Emulation.setDeviceMetricsOverride", width=width, height=1000, deviceScaleFactor=1, mobile=False)
        self.browser.get(self.runs[name].as_uri())

    def tearDown(self):
        self.assertEqual(self.browser.get_log("browser"), [])

    def shot(self, name, selector="body"):
        box = self.script("const r = document.querySelector(arguments[0]).getBoundingClientRect();"
                          "return [r.left + scrollX, r.top + scrollY, r.width, r.height]", selector)
        data = self.command("Page.captureScreenshot", captureBeyondViewport=True,
                            clip=dict(zip(("x", "y", "width", "height"), box), scale=1))["data"]
        picture = Image.open(io.BytesIO(base64.b64decode(data))).convert("RGB")
        SHOTS.mkdir(parents=True, exist_ok=True)
        picture.save(SHOTS / f"{name}.png")
        return np.asarray(picture).astype(int)

    def assert_pictures_are_there(self):
        time.sleep(0.1)
        missing = self.script("return [...document.images].filter(i => !i.complete || !i.naturalWidth).map(i => i.alt)")
        self.assertEqual(missing, [])

    def test_pictures_load_and_nothing_else(self):
        for name, least in (("cube", 12 + 4), ("letter", 3 + 1 + 4), ("comparison", 3), ("reconstruction", 5)):
            for scheme in ("light", "dark"):
                self.open(name, scheme)
                self.assertGreaterEqual(len(self.find("img")), least, name)
                self.assert_pictures_are_there()
                loaded = self.script("return performance.getEntriesByType('resource').map(e => e.name)")
                self.assertEqual([url for url in loaded if not url.startswith("data:")], [])
                self.shot(f"{name}_{scheme}")

    def test_sliders_change_pictures(self):
        self.open("cube")
        sliders = self.find("#images input[type=range]")

        def images():
            return [i.get_attribute("src") for i in self.find("#images img")]

        self.assertEqual(len(sliders), 4)
        last = images()
        sliders[3].send_keys(Keys.HOME)
        self.assert_pictures_are_there()
        first = images()
        self.assertEqual([s.get_attribute("value") for s in sliders], ["0"] * 4)
        self.assertTrue(sliders[0].get_attribute("aria-valuetext").startswith("iteration 0, RMS of the difference"))
        changed = [a != b for a, b in zip(first, last)]
        self.assertEqual(changed[1::3], [False] * 4)  # targets
        self.assertTrue(changed[9] and changed[11])  # image and difference of the gate with most light
        self.assertIn("iteration 0", self.find("#images img")[9].get_attribute("alt"))
        self.find("#together")[0].click()
        sliders[0].send_keys(Keys.ARROW_RIGHT)
        self.assertEqual([s.get_attribute("value") for s in sliders], ["1", "0", "0", "0"])
        self.shot("cube_slider", "#images")

    def test_the_capture_has_a_slider_too(self):
        self.open("letter")
        slider, = self.find("#capture input[type=range]")
        last = self.find("#capture img")[0].get_attribute("src")
        slider.send_keys(Keys.ARROW_LEFT)
        self.assertNotEqual(self.find("#capture img")[0].get_attribute("src"), last)
        self.assert_pictures_are_there()

    def view(self):
        """Pixels of the canvas alone, without the mark of focus around it."""
        data = self.script("return arguments[0].toDataURL().split(',')[1]", self.find("#view")[0])
        return np.asarray(Image.open(io.BytesIO(base64.b64decode(data))).convert("RGBA")).astype(int)

    def test_surfaces_have_colours_that_keys_switch(self):
        self.open("reconstruction")
        shown = {}
        button = self.find("input[value=albedo]")[0]
        for layer, key in (("albedo", None), ("uncertainty", Keys.ARROW_RIGHT), ("shape", Keys.ARROW_RIGHT)):
            if key:
                button.send_keys(key)
                button = self.script("return document.activeElement")
            self.assertEqual(self.find("input[name=layer]:checked")[0].get_attribute("value"), layer)
            self.assertEqual([s.get_attribute("data-layer") for s in self.find("[data-layer]") if s.is_displayed()],
                             [layer] if layer != "shape" else [])
            shown[layer] = self.view()
            self.shot(f"reconstruction_{layer}", "#geometry")
        middle = shown["shape"].shape[1] // 2

        def colours(layer):  # of what is drawn of the fit in full, in the right half
            part = shown[layer][:, middle:]
            return part[(part[..., 3] == 255) & (np.ptp(part[..., :3], axis=-1) > 20)][:, :3]

        self.assertGreater(len(colours("shape")), 1000)
        self.assertTrue((colours("shape")[:, 2] > colours("shape")[:, 0]).all())  # the page's blue
        for layer in ("albedo", "uncertainty"):
            self.assertGreater(np.count_nonzero(np.abs(shown[layer] - shown["shape"]).sum(-1) > 60), 1000, layer)
            self.assertGreater((colours(layer)[:, 0] > colours(layer)[:, 2]).mean(), 0.3, layer)  # inferno, plasma: warm
        self.assertGreater(np.count_nonzero(np.abs(shown["albedo"] - shown["uncertainty"]).sum(-1) > 60), 1000)

    def test_geometry_turns(self):
        self.open("cube")
        canvas, = self.find("#view")
        first = self.view()
        self.assertGreater(np.ptp(first, axis=(0, 1)).max(), 150)
        canvas.send_keys(Keys.ARROW_LEFT, "+")
        turned = self.view()
        self.shot("cube_turned", "#geometry")
        self.assertGreater(np.count_nonzero(np.abs(turned - first).sum(-1) > 60), 500)
        canvas.send_keys(Keys.HOME)
        self.assertEqual(np.abs(self.view() - first).max(), 0)
        self.find("#edges")[0].click()
        self.assertGreater(np.abs(self.view() - first).max(), 60)
        self.open("cube", "dark")
        self.assertGreater(np.count_nonzero(np.abs(self.view() - first).sum(-1) > 60), 500)

    def test_charts_tell_values(self):
        self.open("cube")
        chart = self.find("svg.chart")[0]
        self.script("arguments[0].scrollIntoView({block: 'center', behavior: 'instant'})", chart)
        webdriver.ActionChains(self.browser).move_to_element(chart).perform()
        self.assertRegex(self.find(".readout")[0].text, r"^iteration \d: 0\.\d+$")

    def test_readable(self):
        for scheme in ("light", "dark"):
            self.open("cube", scheme)
            for selector in ("h1", "td", ".note", "a", ".badge", "figcaption", ".step", "summary"):
                colour, ground = self.script(
                    "const e = document.querySelector(arguments[0]); let g = e;"
                    "while (g && getComputedStyle(g).backgroundColor === 'rgba(0, 0, 0, 0)') g = g.parentElement;"
                    "return [getComputedStyle(e).color, getComputedStyle(g).backgroundColor]", selector)
                self.assertGreaterEqual(contrast(colour, ground), 4.5, (scheme, selector, colour, ground))

    def test_keyboard_shows_where_it_is(self):
        self.open("cube")
        seen = []
        for _ in range(14):
            webdriver.ActionChains(self.browser).send_keys(Keys.TAB).perform()
            seen.append(self.script("const e = document.activeElement, s = getComputedStyle(e);"
                                    "return [e.className || e.tagName, s.outlineStyle, parseFloat(s.outlineWidth)]"))
        self.assertEqual(seen[0][0], "skip")
        self.assertTrue(all(style != "none" and width >= 2 for _, style, width in seen), seen)

    def test_narrow_screens(self):
        for name in self.runs:
            self.open(name, width=400)
            self.assertLessEqual(self.script("return document.documentElement.scrollWidth"), 400, name)
        self.open("cube", width=400)
        self.shot("cube_narrow")

    def test_print(self):
        self.open("cube")
        slider = self.find("#images input[type=range]")[0]
        slider.send_keys(Keys.HOME)
        data = base64.b64decode(self.command("Page.printToPDF", printBackground=False)["data"])
        self.assertGreater(len(data), 20_000)
        self.assertEqual(slider.get_attribute("value"), slider.get_attribute("max"))  # paper shows the last iteration
        self.open("cube", "dark", "print")
        self.assertFalse(any(e.is_displayed() for e in self.find("input, nav, summary")))
        self.assertEqual(self.script("return getComputedStyle(document.body).color"), "rgb(0, 0, 0)")
        self.shot("cube_print")


if __name__ == "__main__":
    PROGRAM, SHOTS = os.path.abspath(sys.argv[1]), pathlib.Path(sys.argv[2])
    if webdriver is None or DRIVER is None:
        print("left out: it needs chromium, chromium-driver and python3-selenium (scripts/test --browser installs them)")
        sys.exit(MISSING)
    unittest.main(argv=[sys.argv[0], *sys.argv[3:]])
