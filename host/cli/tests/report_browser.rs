//! The report in a real browser: no word on the console, and every control does what it says. Skipped, with a
//! message, where there is no Chromium. `GIOTTO_CAMPAIGNS=DIR` tries every campaign in DIR as well.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "helpers of a test fail as the test does"
)]
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const GIOTTO: &str = env!("CARGO_BIN_EXE_giotto");

const PLAN: &str = r#"[campaign]
name = "browser <b>&amp;</b>"
machine = "simulated mill"
[machine]
squareness_um_per_m = 60.0
both = { kv_per_s = 40.0 }
x = { backlash_um = 6.0 }
[instrument]
noise_um = 0.05
[grid]
radii_mm = [100.0, 200.0]
feeds_mm_s = [20.0, 100.0, 200.0]
"#;

/// Drives the controls and says what came of it.
const DRIVER: &str = r##"<script>
(() => {
  const said = [];
  const check = (what, ok) => said.push((ok ? "ok " : "FAILED ") + what);
  const $ = (id) => document.getElementById(id);
  const change = (e) => e.dispatchEvent(new Event("change", { bubbles: true }));
  const paths = () => [...document.querySelectorAll("#polar .polar-line")].map((p) => p.getAttribute("d")).join();
  const lines = (way) => document.querySelectorAll("#polar .polar-line" + way).length;
  check("curves are drawn", lines("") > 0);
  check("both directions", lines(".CCW") > 0 && lines(".CW") > 0);
  let before = paths();
  $("magnification").value = "50"; change($("magnification"));
  check("magnification", paths() !== before && $("shown").textContent.includes("× 50;"));
  before = paths();
  $("circle").selectedIndex = ($("circle").selectedIndex + 1) % $("circle").length; change($("circle"));
  check("another circle", $("circle").length < 2 || paths() !== before);
  const box = (v) => document.querySelector(`input[value=${v}]`);
  box("CW").checked = false; change(box("CW"));
  check("without CW", lines(".CW") === 0 && lines(".CCW") > 0);
  const n = lines("");
  box("before").checked = true; change(box("before"));
  check("with before", lines("") > n && lines(".before") > 0);
  const data = JSON.parse($("profiles").textContent);
  check("the worst form comes first", Number($("circle").options.length) === data.circles.length);
  const ticks = [...document.querySelectorAll("input[name=off]")];
  check("a box for each cause that is simulated", ticks.length === data.causes.length);
  const said0 = $("answer").textContent;
  ticks.forEach((t) => { t.checked = true; }); if (ticks.length) change(ticks[0]);
  const chosen = $("circle").value;
  window.answers = data.circles.map((c, i) => {
    $("circle").value = i; change($("circle"));
    const round = /out of round ([0-9.]+)(?: → ([0-9.]+))?/.exec($("answer").textContent);
    return `answer ${c.r} ${/, ([0-9.]+) mm.s,/.exec(c.label)[1]} ${round[1]} ${round[2] ?? round[1]}`;
  });
  $("circle").value = chosen; change($("circle"));
  check("what if", ticks.length === 0 || (lines(".whatif") > 0 && $("answer").textContent !== said0));
  $("tolerance").value = "1000000"; change($("tolerance"));
  check("tolerance held", /: .*held/.test($("answer").textContent) && !/: .*not held/.test($("answer").textContent));
  const at = () => $("polar").getAttribute("aria-valuenow");
  const key = (k) => $("polar").dispatchEvent(new KeyboardEvent("keydown", { key: k, bubbles: true, cancelable: true }));
  key("ArrowRight"); key("PageUp");
  check("keys", at() === "32");
  check("words for a screen reader", $("polar").getAttribute("aria-valuetext").includes("measured"));
  const r = $("polar").getBoundingClientRect();
  $("polar").dispatchEvent(new PointerEvent("pointermove", { clientX: r.left + r.width / 2, clientY: r.top + 5, bubbles: true }));
  check("hover", Math.abs(Number(at()) - 90) <= 2 && /left before [+−]/.test($("readout").textContent));
  check("focus by keyboard", $("polar").tabIndex === 0);
  dispatchEvent(new Event("beforeprint"));
  check("everything is open on paper", [...document.querySelectorAll("details")].every((d) => d.open));
  check("nothing fetched", performance.getEntriesByType("resource").length === 0);
  check("no script failed", window.failures.length === 0);
  const out = document.createElement("pre");
  out.id = "probe"; out.textContent = said.concat(window.failures, window.answers).join("\n"); document.body.append(out);
})();
</script>"##;

fn chromium() -> Option<&'static str> {
    ["chromium", "chromium-browser", "google-chrome"]
        .into_iter()
        .find(|name| {
            Command::new(name)
                .arg("--version")
                .output()
                .is_ok_and(|o| o.status.success())
        })
}

fn giotto(arguments: &[&str]) -> Output {
    let output = Command::new(GIOTTO).args(arguments).output().unwrap();
    assert!(
        output.status.success(),
        "{arguments:?}: {}",
        String::from_utf8_lossy(&output.stderr)
    );
    output
}

fn browse(browser: &str, page: &Path, profile: &Path) -> (String, String) {
    let output = Command::new(browser)
        .args([
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-background-networking",
            "--no-first-run",
            "--enable-logging=stderr",
            "--virtual-time-budget=2000",
            "--dump-dom",
        ])
        .arg(format!("--user-data-dir={}", profile.display()))
        .arg(format!("file://{}", page.display()))
        .output()
        .unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (text(&output.stdout), text(&output.stderr))
}

#[test]
fn the_controls_work_and_the_console_is_silent() {
    let Some(browser) = chromium() else {
        eprintln!("skipped: no chromium on this machine (apt-get install chromium)");
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("plan.toml"), PLAN).unwrap();
    let text = |path: &PathBuf| path.to_str().unwrap().to_owned();
    giotto(&[
        "simulate",
        &text(&at("plan.toml")),
        "-o",
        &text(&at("campaign")),
    ]);
    let mut campaigns = vec![at("campaign")];
    if let Some(more) = std::env::var_os("GIOTTO_CAMPAIGNS") {
        let all = std::fs::read_dir(more)
            .unwrap()
            .map(|entry| entry.unwrap().path());
        campaigns.extend(all.filter(|path| path.join("campaign.toml").exists()));
    }
    for (i, campaign) in campaigns.iter().enumerate() {
        let page = at(&format!("{i}.html"));
        giotto(&["report", &text(campaign), "-o", &text(&page)]);
        let html = std::fs::read_to_string(&page).unwrap();
        assert!(
            html.len() < 3_000_000,
            "{}: {} bytes",
            campaign.display(),
            html.len()
        );
        let catcher = "<head><script>window.failures=[];addEventListener('error',(e)=>failures.push(e.message))</script>";
        let driven =
            html.replacen("<head>", catcher, 1)
                .replacen("</body>", &format!("{DRIVER}</body>"), 1);
        std::fs::write(&page, driven).unwrap();
        let (dom, log) = browse(browser, &page, &at(&format!("profile{i}")));
        assert!(!log.contains("CONSOLE"), "{}: {log}", campaign.display());
        let probe = dom
            .split("<pre id=\"probe\">")
            .nth(1)
            .unwrap_or_else(|| unreachable!("no answer: {log}"));
        let probe = probe.split("</pre>").next().unwrap();
        let checks = || probe.lines().filter(|line| !line.starts_with("answer "));
        assert_eq!(checks().count(), 17, "{probe}");
        assert!(
            checks().all(|line| line.starts_with("ok ")),
            "{}:\n{probe}",
            campaign.display()
        );
        if i == 0 {
            mended(folder.path(), probe);
        }
    }
}

/// With every cause ticked off, the page's roundness is that of the simulated machine without the faults, to 1 µm, on
/// every circle; with none it is that of the machine as it was.
fn mended(folder: &Path, probe: &str) {
    let healthy: String = PLAN
        .lines()
        .filter(|line| !line.starts_with("squareness") && !line.starts_with("x = "))
        .map(|line| format!("{line}\n"))
        .collect();
    std::fs::write(folder.join("healthy.toml"), healthy).unwrap();
    let [plan, place] = ["healthy.toml", "healthy"].map(|n| folder.join(n).display().to_string());
    giotto(&["simulate", &plan, "-o", &place]);
    let as_it_was = folder.join("campaign").display().to_string();
    let rounds = |campaign: &str| {
        let document = giotto(&["analyze", campaign, "--json"]).stdout;
        let document: serde_json::Value = serde_json::from_slice(&document).unwrap();
        let runs = document["runs"].as_array().unwrap().clone();
        move |radius: f64, feed: f64| {
            let of = |run: &serde_json::Value, key: &str| run[key].as_f64().unwrap();
            let same = |run: &&serde_json::Value| {
                (of(run, "radius_mm") - radius).abs() < 1e-6
                    && (of(run, "feed_mm_s") - feed).abs() < 1e-6
            };
            let all = runs
                .iter()
                .filter(same)
                .map(|run| of(run, "out_of_roundness_um"));
            all.fold(0.0, f64::max)
        }
    };
    let (before, after) = (rounds(&as_it_was), rounds(&place));
    let answers: Vec<Vec<f64>> = probe
        .lines()
        .filter_map(|line| line.strip_prefix("answer "))
        .map(|line| line.split(' ').map(|v| v.parse().unwrap()).collect())
        .collect();
    assert_eq!(answers.len(), 6, "{probe}");
    for answer in answers {
        let [radius, feed, now, then] = answer[..] else {
            unreachable!("four numbers: {answer:?}")
        };
        let (measured, mended) = (before(radius, feed), after(radius, feed));
        // A step inside a sector of 2° is smoothed there; the sample noise of this plan is 0.05 µm.
        assert!(
            (now - measured).abs() < 1.0,
            "R {radius} f {feed}: {now} {measured}"
        );
        assert!(
            (then - mended).abs() < 1.0,
            "R {radius} f {feed}: {then} {mended}"
        );
    }
}

/// The page of a corrected program: nothing on the console, and on a phone no word or drawing wider than the screen.
#[test]
fn the_page_of_a_program_fits_a_phone() {
    let Some(browser) = chromium() else {
        eprintln!("skipped: no chromium on this machine (apt-get install chromium)");
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let page = program_page(folder.path());
    let html = std::fs::read_to_string(&page).unwrap();
    let framed = folder.path().join("phone.html");
    let quoted = html.replace('&', "&amp;").replace('"', "&quot;");
    std::fs::write(
        &framed,
        format!(
            r#"<!doctype html><iframe style="width:390px;height:3000px;border:0" srcdoc="{quoted}"></iframe><script>
addEventListener("load", () => {{
  const d = document.querySelector("iframe").contentDocument;
  const wide = [...d.querySelectorAll("body *")].filter((e) => !e.closest(".scroll") && !e.closest("svg") && e.getBoundingClientRect().right > 391);
  const small = [...d.querySelectorAll("svg.plan text")].filter((t) => t.getBoundingClientRect().height < 9);
  const out = document.createElement("pre");
  out.id = "probe"; out.textContent = `wide ${{wide.map((e) => e.outerHTML.slice(0, 80))}} small ${{small.length}} drawn ${{d.querySelectorAll("svg.plan path.stroke").length}}`;
  document.body.append(out);
}});</script>"#
        ),
    )
    .unwrap();
    let (dom, log) = browse(browser, &framed, &folder.path().join("profile"));
    assert!(!log.contains("CONSOLE"), "{log}");
    let probe = dom.split("<pre id=\"probe\">").nth(1).unwrap();
    let probe = probe.split("</pre>").next().unwrap();
    let drawn: usize = probe.rsplit(' ').next().unwrap().parse().unwrap();
    assert!(probe.starts_with("wide  small 0 ") && drawn >= 4, "{probe}");
}

/// Corrects a small part with one arc that is left, and checks what can be checked without a browser.
fn program_page(folder: &Path) -> PathBuf {
    let at = |name: &str| folder.join(name).to_str().unwrap().to_owned();
    std::fs::write(
        at("model.toml"),
        "format = 2\ncampaign = \"lab\"\nmachine = \"mill <1>\"\n[servo]\nkind = \"lag\"\nkv_per_s = 25.0\n\
         [valid]\nradius_mm = [1.0, 300.0]\nfeed_mm_s = [1.0, 100.0]\n",
    )
    .unwrap();
    std::fs::write(
        at("part<b>.nc"),
        "G21 G17 G90 F1500\nG0 X0 Y0\nG1 X20\nG3 X30 Y10 J10\nG1 Y30\nG3 X20 Y40 I-10\nG1 X0\nG0 Z5\nG41 D1\nG3 X-10 Y30 J-10\nG40\nM2\n",
    )
    .unwrap();
    giotto(&[
        "compensate",
        &at("part<b>.nc"),
        "--model",
        &at("model.toml"),
        "-o",
        &at("out.nc"),
        "--report",
        &at("part.html"),
    ]);
    let html = std::fs::read_to_string(at("part.html")).unwrap();
    for scheme in [
        "http:", "https:", "src=", "url(", "@import", "<script", "<b>",
    ] {
        assert!(!html.contains(scheme), "{scheme}");
    }
    for words in [
        "2 of 3 arcs corrected",
        "What was left, and why",
        "cutter radius compensation is on since G41 in line 9",
        "2 arcs in the plane XY",
        "class=\"stroke left-arc\"",
        "class=\"stroke d5\"",
        "largest contour error before and after",
    ] {
        assert!(html.contains(words), "{words} in\n{html}");
    }
    PathBuf::from(at("part.html"))
}

#[test]
fn the_page_of_a_program_is_one_file_and_says_what_was_left() {
    let folder = tempfile::tempdir().unwrap();
    program_page(folder.path());
}
