"""Opens a report page in headless Chromium: no console errors, a scene in the 3-D view, values after a click.

    python3 report_page.py PAGE.html [SCREENSHOT.png [WIDTH]]

Needs chromium and chromedriver on the path; speaks WebDriver over HTTP with Python's standard library alone.
"""
import base64, json, pathlib, re, shutil, socket, subprocess, sys, time, urllib.request

FLAGS = ["--headless=new", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
         "--hide-scrollbars"]
ELEMENT = "element-6066-11e4-a52e-4f735466cecf"
# Share of the view's pixels that are not its background: (30, 33, 36).
COVERED = """
const view = document.getElementById("canvas"), copy = document.createElement("canvas");
[copy.width, copy.height] = [view.width, view.height];
const context = copy.getContext("2d");
context.drawImage(view, 0, 0);
const data = context.getImageData(0, 0, copy.width, copy.height).data;
let other = 0;
const colours = new Set();
for (let k = 0; k < data.length; k += 4) {
  other += Math.abs(data[k] - 30) + Math.abs(data[k + 1] - 33) + Math.abs(data[k + 2] - 36) > 6;
  colours.add(data[k] << 16 | data[k + 1] << 8 | data[k + 2]);
}
return [4 * other / data.length, colours.size];
"""


class Browser:
    def __init__(self, width):
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            port = probe.getsockname()[1]
        self.driver = subprocess.Popen(["chromedriver", f"--port={port}"], stdout=subprocess.DEVNULL)
        self.base = f"http://127.0.0.1:{port}"
        for _ in range(100):
            try:
                self.call("GET", "/status")
                break
            except OSError:
                time.sleep(0.1)
        # Chromium makes no window narrower than 500 pixels: narrow ones are emulated, as on a telephone.
        options = {"args": FLAGS + [f"--window-size={width},1000"]}
        if width < 500:
            options["mobileEmulation"] = {"deviceMetrics": {"width": width, "height": 800, "pixelRatio": 1}}
        wanted = {"browserName": "chrome", "goog:chromeOptions": options, "goog:loggingPrefs": {"browser": "ALL"}}
        made = self.call("POST", "/session", {"capabilities": {"alwaysMatch": wanted}})
        self.base += "/session/" + made["sessionId"]

    def call(self, method, path, body=None):
        data = json.dumps(body if body is not None else {}).encode() if method == "POST" else None
        request = urllib.request.Request(self.base + path, data, {"Content-Type": "application/json"}, method=method)
        with urllib.request.urlopen(request, timeout=120) as answer:
            return json.load(answer)["value"]

    def script(self, text):
        return self.call("POST", "/execute/sync", {"script": text, "args": []})

    def element(self, css):
        return self.call("POST", "/element", {"using": "css selector", "value": css})

    def click(self, css, x=0, y=0):
        mouse = {"type": "pointer", "id": "mouse", "parameters": {"pointerType": "mouse"}, "actions": [
            {"type": "pointerMove", "origin": self.element(css), "x": x, "y": y, "duration": 0},
            {"type": "pointerDown", "button": 0}, {"type": "pointerUp", "button": 0}]}
        self.call("POST", "/actions", {"actions": [mouse]})

    def log(self):
        return [f"{entry['level']}: {entry['message']}" for entry in self.call("POST", "/se/log", {"type": "browser"})]

    def close(self):
        try:
            self.call("DELETE", "")
        finally:
            self.driver.terminate()
            self.driver.wait()


def check(page, screenshot=None, width=1280):
    browser = Browser(width)
    try:
        browser.call("POST", "/url", {"url": pathlib.Path(page).resolve().as_uri()})
        time.sleep(0.5)
        covered, colours = browser.script(COVERED)
        print(f"3-D view: {covered:.1%} covered, {colours} colours")
        assert covered > 0.05 and colours > 20, "the 3-D view is empty"
        browser.script("document.getElementById('canvas').scrollIntoView({block: 'center'})")
        browser.click("#canvas")
        picked = browser.script("return document.getElementById('picked').innerText")
        print("picked:", " | ".join(picked.split("\n")))
        for what in ["face", "group", "material", "area", "B, W", "H, W", "error"]:
            assert what in picked, f"a click tells no {what}: {picked}"
        assert re.search(r"H, W m⁻²\s+[-0-9.e+−]+\s", picked), f"no numbers: {picked}"
        # Every paint draws something of its own; keys turn the view.
        seen = {}
        for paint in browser.script("return [...document.querySelectorAll('#paint option')].map(o => o.value)"):
            browser.script(f"const p = document.getElementById('paint'); p.value = '{paint}'; p.dispatchEvent(new Event('input'))")
            time.sleep(0.3)
            seen[paint] = browser.script("return document.getElementById('canvas').toDataURL()")
        assert len(set(seen.values())) == len(seen), "two paints look the same"
        browser.call("POST", f"/element/{browser.element('#canvas')[ELEMENT]}/value", {"text": "\ue012\ue012"})
        time.sleep(0.3)
        turned = browser.script("return document.getElementById('canvas').toDataURL()")
        assert turned not in seen.values(), "arrow keys do not turn the view"
        overflow = browser.script("return document.documentElement.scrollWidth - document.documentElement.clientWidth")
        assert overflow <= 0, f"the page is {overflow} pixels wider than its window"
        log = browser.log()
        assert not log, "console: " + "\n".join(log)
        if screenshot:
            browser.script("const p = document.getElementById('paint'); p.value = 'radiosity'; p.dispatchEvent(new Event('input'));"
                           "document.getElementById('reset').click(); scrollTo(0, 0)")
            time.sleep(0.5)
            shot = browser.call("POST", "/goog/cdp/execute", {"cmd": "Page.captureScreenshot",
                                                            "params": {"captureBeyondViewport": True}})
            pathlib.Path(screenshot).write_bytes(base64.b64decode(shot["data"]))
    finally:
        browser.close()


if __name__ == "__main__":
    if not (shutil.which("chromedriver") and shutil.which("chromium")):
        sys.exit("chromium or chromedriver is missing: apt-get install chromium chromium-driver")
    check(sys.argv[1], sys.argv[2] if len(sys.argv) > 2 else None, int(sys.argv[3]) if len(sys.argv) > 3 else 1280)
    print("passed")
