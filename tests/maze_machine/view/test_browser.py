"""The page in a real browser, headless: what a person sees of it and can do with it."""

import re
import shutil
import socket
from contextlib import contextmanager
from functools import partial
from queue import Queue
from threading import Thread

import pytest

import hsm
from maze_machine.catalogue.library import robot_names
from maze_machine.catalogue.profile import load_profile
from maze_machine.commands.opened_run import Openings, opened_run
from maze_machine.commands.view import view_remote
from maze_machine.drive.mission import Ending, drive, prepare
from maze_machine.remote.messages import encoded
from maze_machine.remote.opened import OpenRun
from maze_machine.remote.operated import OperatedRun
from maze_machine.report.pages import ShownRun, network_head, run_head
from maze_machine.report.tried import TriedMachine, tried_head
from maze_machine.simulated.world import SimulatedWorld, find_maze
from maze_machine.view.drawings import Drawings
from maze_machine.view.live import Feed, LivePage, SimulatedTime
from maze_machine.view.page import head, replay_page
from transport.connect import listening
from transport.description import RobotDescription
from transport.keys import MachineKeys
from transport.robot import LinkError
from transport.world import LockstepRobot

sync_api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe-playwright-python is not installed")
pytest.importorskip("pygraphviz")
CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium here: Debian's package `chromium` brings it")
LIMIT = 20_000
SECONDS = 30.0
SERIOUS = ("serious", "critical")


@pytest.fixture
def free_endpoint():
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{one.getsockname()[1]}"


@pytest.fixture(scope="module")
def browser():
    with sync_api.sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield started
        started.close()


@pytest.fixture
def opened(browser):
    """Opens an address in a window of some size; at the end nothing may stand in the console."""
    contexts, said = [], []

    def show(address, width=1280, height=800, *, bypass_csp=True, first=True, **options):
        window = {"width": width, "height": height}
        context = browser.new_context(viewport=window, bypass_csp=bypass_csp, **options)
        contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(LIMIT)
        page.add_init_script(
            "globalThis.drawnAt = [];"
            "new MutationObserver((_, watch) => { if (document.body?.dataset.shown) "
            "{ drawnAt.push(store.frames.length); watch.disconnect(); } })"
            ".observe(document, { subtree: true, childList: true, attributes: true });"
        )
        page.on("console", lambda message: said.append(message.text))
        page.on("pageerror", lambda error: said.append(str(error)))
        page.goto(address)
        page.wait_for_selector("body[data-shown][data-ready]" if first else "body[data-ready]")
        return page

    yield show
    for context in contexts:
        context.close()
    assert said == []


@pytest.fixture(scope="module")
def driven():
    """The ticks of the first seconds of a run of pledge, with its mission and world."""
    mission = prepare("pledge", load_profile(), time_limit=SECONDS)
    world = SimulatedWorld(find_maze("final_2015", robot=RobotDescription()), mission.profile.robot)
    robot, frames = LockstepRobot(world), []
    shown = ShownRun(lambda frame: frames.append(frame()), lambda _: None)
    ending = drive(mission, robot, robot, [shown], truth=world.pose)
    return mission, world, frames, ending


@pytest.fixture(scope="module")
def recorded(driven, tmp_path_factory):
    """The address of a page of that run."""
    mission, world, frames, ending = driven
    told = {**run_head(mission, world), "drawings": Drawings(mission.machine).all()}
    file = tmp_path_factory.mktemp("page") / "run.html"
    file.write_text(replay_page(told, frames, ending.as_json()), encoding="utf-8")
    return file.as_uri()


@contextmanager
def live(driven, *, count=40):
    """A page of a run that is still running: its ticks so far, and what its operators have asked for."""
    mission, world, frames, _ = driven
    drawings, operated = Drawings(mission.machine), OperatedRun(mission, pausable=True)
    asked = []

    def operate(question):
        asked.append(question)
        return operated.answer(question)

    told = run_head(mission, world)

    def simulation():
        return SimulatedTime(pausable=True, paused=operated.paused)

    with LivePage(told, operate=operate, drawn=drawings.drawn, simulation=simulation) as page:
        for frame in frames[:count]:
            page.publish(partial(dict, frame))
        yield page, asked, frames


def lit(page):
    return set(page.evaluate("machine.lit()"))


def settled(page):
    """Let the page draw what it has been told."""
    page.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")


def test_active_states_are_lit_and_the_reasons_are_those_of_the_tick(opened, recorded, driven):
    _, _, frames, _ = driven
    page = opened(recorded)
    for at in (0, 120, 251):
        page.evaluate(f"app.seek({at})")
        page.wait_for_function(f"machine.lit().includes({frames[at]['doing']!r})")
        assert lit(page) <= set(frames[at]["states"])
        rows = page.locator("#reasons tbody tr:not(.apart)")
        told = {rows.nth(row).locator("td").nth(3).get_attribute("title") for row in range(rows.count())}
        assert not any("not considered" in text for text in rows.all_inner_texts())
        for one in frames[at]["why"]:
            if page.evaluate(f"model.transitions[{one['transition']}].source") == frames[at]["doing"]:
                assert one["reason"] in told
    assert page.locator("#status").inner_text().startswith("unfinished: still inside")


def test_a_taken_transition_flashes(opened, recorded, driven):
    _, _, frames, _ = driven
    page = opened(recorded)
    at = next(frame["tick"] for frame in frames if frame["fired"] and frame["tick"] > 5)
    page.evaluate(f"app.seek({at})")
    page.wait_for_function("document.querySelectorAll('.drawing .edge.flash').length > 0")
    assert page.locator("#facts").inner_text().count("took") >= 1


def test_scrubbing_keys_and_links_lead_to_a_moment(opened, recorded):
    page = opened(f"{recorded}#t=12.3")
    assert page.evaluate("app.at") == 123
    page.locator("#at").focus()
    page.keyboard.press("ArrowRight")
    page.keyboard.press("Shift+ArrowRight")
    assert page.evaluate("app.at") == 134
    page.keyboard.press("p")
    assert page.evaluate("store.frames[app.at].taken.length") > 0
    page.wait_for_function("location.hash === `#t=${store.time(app.at).toFixed(1)}`")
    page.locator("#lanes canvas").first.click(position={"x": 100, "y": 8})
    assert page.evaluate("app.at") != 134
    page.keyboard.press("Home")
    assert page.evaluate("app.at") == 0


def test_a_long_recording_is_shown_before_it_is_read_and_a_link_waits_for_its_moment(opened, tmp_path, driven):
    mission, world, frames, _ = driven
    many = [
        {**frames[index % len(frames)], "tick": index, "stamp": index * 100_000_000, "time": index / 10}
        for index in range(3000)
    ]
    file = tmp_path / "long.html"
    file.write_text(replay_page(run_head(mission, world), many), encoding="utf-8")
    page = opened(f"{file.as_uri()}#t=290.0")
    assert page.evaluate("[app.at, store.frames.length, store.complete]") == [2900, 3000, True]
    assert page.evaluate("store.frames.every((one, index) => one.tick === index)")
    drawn = page.evaluate("drawnAt")
    assert drawn[0] < 3000
    page.wait_for_function(
        """(() => {
            const at = document.querySelector("#chart .cursor").getBoundingClientRect().left;
            const lane = document.querySelector("#lanes canvas").getBoundingClientRect();
            return Math.abs(at - (lane.left + lane.width * 2900 / 3000)) < 3;
        })()"""
    )  # in the chart a moment lies below the same moment of the lanes


def test_it_plays_in_real_time_and_pauses(opened, recorded):
    page = opened(recorded)
    page.keyboard.press(" ")
    page.wait_for_function("app.at > 3")
    page.keyboard.press(" ")
    at = page.evaluate("app.at")
    settled(page)
    assert page.evaluate("app.at") == at
    assert page.evaluate("document.getElementById('speed').value") == "1"


def test_a_folded_state_opens_and_a_state_is_chosen(opened, recorded):
    page = opened(recorded)
    page.select_option("#opened", "run")
    page.wait_for_selector("g.state[aria-label='watch']")
    page.locator("g.state[aria-label='watch']").focus()
    page.keyboard.press("Enter")
    page.wait_for_selector("g.state[aria-label='watch.well']")
    assert page.input_value("#chosen") == "watch"


def test_pause_holds_the_view_of_a_run_that_goes_on(opened, driven):
    with live(driven) as (served, _, frames):
        page = opened(served.address)
        page.wait_for_function("app.at === 39")
        page.click("#play")
        for frame in frames[40:80]:
            served.publish(partial(dict, frame))
        page.wait_for_function("store.frames.length === 80")
        settled(page)
        assert page.evaluate("app.at") == 39
        page.click("#newest")
        page.wait_for_function("app.at === 79")
        page.wait_for_load_state("networkidle")  # the drawing is there before its server ends


def test_it_works_under_its_own_policy(opened, driven):
    with live(driven) as (served, _, _):
        page = opened(served.address, bypass_csp=False)
        page.wait_for_selector("#drawing svg g.state.active")
        page.wait_for_selector("#simulation:not([hidden])")


def test_without_graphviz_the_browser_draws_the_machine(opened, driven, tmp_path, monkeypatch):
    monkeypatch.setattr("hsm.interchange.diagrams.installed", lambda: False)
    mission, world, frames, ending = driven
    told = {**run_head(mission, world), "drawings": Drawings(mission.machine).all()}
    assert told["drawings"][""].startswith("digraph")
    file = tmp_path / "run.html"
    file.write_text(replay_page(told, frames[:40], ending.as_json()), encoding="utf-8")
    with live(driven) as (served, _, _):
        for address, own in ((file.as_uri(), {}), (served.address, {"bypass_csp": False})):
            page = opened(address, **own)
            page.wait_for_selector("#drawing svg g.state.active")
            page.wait_for_function("store.frames.length === 40")
            page.evaluate("app.seek(39)")
            settled(page)
            page.wait_for_selector("#drawing svg g.state.active.node")
            assert lit(page) <= set(frames[39]["states"])
            assert page.locator("#drawing svg [fill]").count() == 0


def test_of_a_graph_only_shapes_are_drawn(opened, driven, tmp_path):
    mission, world, frames, _ = driven
    graph = 'digraph { a [URL="javascript:alert(1)", label="a", id="state_1"]; a -> a [class="t99999", label="x"] }'
    file = tmp_path / "run.html"
    told = {**run_head(mission, world), "drawings": dict.fromkeys(Drawings(mission.machine).names(), graph)}
    file.write_text(replay_page(told, frames[:2]), encoding="utf-8")
    page = opened(file.as_uri())
    page.wait_for_selector("#drawing svg")
    assert page.locator("#drawing a, #drawing [href], #drawing [style*=fill]").count() == 0


def test_stop_is_always_there_and_is_confirmed_only_when_the_base_stands(opened, driven):
    with live(driven) as (served, asked, _):
        page = opened(served.address, 390, 844)
        stop = page.locator("#stop")
        page.evaluate("scrollTo(0, document.body.scrollHeight)")
        settled(page)
        box = stop.bounding_box()
        assert box["y"] >= 0
        assert box["y"] + box["height"] <= 844
        assert box["height"] >= 40
        stop.click()
        page.wait_for_function("document.getElementById('status').textContent.startsWith('Stopping')")
        assert asked == [b'{"kind":"end"}']
        served.end(Ending(None, "an operator ended the run", 40, 4.0, 1.0, 0.01, {}).as_json())
        page.wait_for_function("document.getElementById('status').textContent.includes('The base has stopped.')")
        assert stop.is_hidden()
        assert page.inner_text("#play") == "Play"
        assert page.is_visible("#speed")


def test_a_stop_that_nobody_answers_is_not_confirmed(opened, driven, free_endpoint, monkeypatch):
    mission, world, frames, _ = driven
    pages = Queue()
    monkeypatch.setattr("maze_machine.commands.opened_run.announce", pages.put)
    monkeypatch.setattr("maze_machine.commands.opened_run.GRACE", 0.5)
    monkeypatch.setattr("maze_machine.commands.view.SILENCE", 1.0)
    told = network_head(run_head(mission, world), Drawings(mission.machine))
    keys = MachineKeys(mission.profile.robot.name)
    with listening(free_endpoint) as bus:
        bus.serve(keys.model, lambda request: request.reply(encoded(told)))
        answering = [True]
        newest = {name: one for name, one in frames[200].items() if name != "sights"}
        bus.serve(keys.step, lambda request: request.reply(encoded(newest)) if answering[0] else None)
        viewing = Thread(target=lambda: view_remote(free_endpoint, "pico", None, "127.0.0.1", 0))
        viewing.start()
        page = opened(pages.get(timeout=LIMIT / 1000).address)
        assert page.inner_text("#now").startswith("20.0 s")
        page.click("#stop")
        page.wait_for_function("element('status').textContent.startsWith('Not stopped, the machine does not answer')")
        assert page.is_enabled("#stop")
        answering[0] = False
        page.wait_for_function("element('status').textContent.startsWith('the machine no longer answers')")
        assert "not confirmed that the base has stopped. Use the robot's own stop" in page.inner_text("#status")
        page.close()
        viewing.join(LIMIT / 1000)
        assert not viewing.is_alive()


def test_a_run_that_fails_says_so_on_its_page(opened, driven, monkeypatch):
    mission, _, _, _ = driven
    pages = Queue()
    monkeypatch.setattr("maze_machine.commands.opened_run.announce", pages.put)
    monkeypatch.setattr("maze_machine.commands.opened_run.GRACE", 0.5)
    failed = Queue()

    def run():
        try:
            with opened_run(Openings(None, None, True, "127.0.0.1", 0), mission, None, None):
                raise LinkError("'pico' has not answered for 2 s")
        except LinkError as error:
            failed.put(error)

    running = Thread(target=run)
    running.start()
    browser_page = opened(pages.get(timeout=LIMIT / 1000).address, first=False)
    browser_page.wait_for_function("element('status').textContent.startsWith(\"'pico' has not answered for 2 s.\")")
    assert "not confirmed that the base has stopped" in browser_page.inner_text("#status")
    browser_page.close()
    assert failed.get(timeout=LIMIT / 1000)
    running.join(LIMIT / 1000)


def test_where_the_server_goes_nothing_is_confirmed(opened, driven):
    with live(driven) as (served, _, _):
        page = opened(served.address)
        page.click("#stop")
    page.wait_for_function("document.getElementById('status').textContent.includes('not confirmed')")


def test_a_simulation_is_paused_stepped_and_sent_events(opened, driven):
    with live(driven) as (served, asked, _):
        page = opened(served.address)
        page.click("#hold")
        page.wait_for_function("document.getElementById('hold').textContent === 'Resume simulation'")
        page.click("#step")
        page.select_option("#pace", "4")
        page.select_option("#event", "blinded")
        page.click("#send")
        page.wait_for_function("document.getElementById('status').textContent === 'Sent blinded'")
        kinds = [re.search(rb'"kind":"(\w+)"', one)[1] for one in asked]
        assert kinds == [b"pause", b"advance", b"speed", b"event"]


STEERED = """machine steered

event go(far : length)

param pace : speed = 0.2 m/s, adjustable(0.1 m/s, 0.3 m/s)

state idle
    do stop()
    on go -> moving

state moving
    do drive(speed = pace)
    after 5 s -> idle
"""


def test_a_run_is_steered_and_pauses_at_a_place(opened, tmp_path):
    file = tmp_path / "steered.maze-machine"
    file.write_text(STEERED, encoding="utf-8")
    mission = prepare(str(file), load_profile(), time_limit=SECONDS)
    world = SimulatedWorld(find_maze("corridor", robot=RobotDescription()), mission.profile.robot)
    operated, robot = OperatedRun(mission, pausable=True), LockstepRobot(world)
    operated.answer(b'{"kind": "pause"}')

    def simulation():
        return SimulatedTime(operated.pausable, operated.paused)

    drawn = Drawings(mission.machine).drawn
    with LivePage(run_head(mission, world), operate=operated.answer, drawn=drawn, simulation=simulation) as served:
        watchers = [ShownRun(served.publish, served.end), operated]
        work = Thread(target=lambda: drive(mission, robot, robot, watchers, operator=operated))
        work.start()
        page = opened(served.address)
        page.wait_for_function("element('hold').textContent === 'Resume simulation'")
        page.fill("#break-place", "moving")
        page.locator("#break-at button").click()
        page.wait_for_function("element('status').textContent === 'Pauses at: moving'")
        page.fill("#value", "0.5 m/s")
        page.click("#adjust")
        page.wait_for_function("element('status').textContent.includes('takes 0.1 m/s to 0.3 m/s, not 0.5 m/s')")
        page.fill("#value", "0.3 m/s")
        page.keyboard.press("Enter")
        page.wait_for_function("element('status').textContent === 'Set pace = 0.3 m/s'")
        page.select_option("#event", "go")
        page.fill("#event-data", "far = 2 m")
        page.click("#send")
        page.wait_for_function("element('status').textContent === 'Sent go(far = 2 m)'")
        page.click("#hold")
        page.wait_for_function("element('status').textContent === 'Paused: moving'")
        page.wait_for_function("machine.lit().includes('moving')")
        assert page.evaluate("[store.last.tick, store.last.variables.pace, store.last.events]") == [
            1,
            0.3,
            ["pace = 0.3 m/s", "go(far = 2 m)"],
        ]
        assert page.locator("#hold").inner_text() == "Resume simulation"
        page.click("#stop")
        work.join(LIMIT / 1000)
        assert not work.is_alive()
        page.wait_for_function("element('status').textContent.includes('The base has stopped')")


@pytest.mark.parametrize(
    ("width", "height", "options"),
    [
        (390, 844, {}),
        (1280, 800, {}),
        (1920, 1080, {"color_scheme": "dark"}),
        (640, 400, {"device_scale_factor": 2}),  # 1280x800 at a zoom of 200 %
    ],
)
def test_it_fits_every_window_and_its_labels_can_be_read(opened, recorded, width, height, options):
    page = opened(f"{recorded}#t=20", width, height, **options)
    page.wait_for_selector("#drawing svg g.state")
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    for part in ("#scene", "#drawing", "#why", "#play", "#at"):
        assert page.locator(part).bounding_box()["width"] >= (width / 3 if part in ("#scene", "#drawing") else 30)
    smallest = page.evaluate(
        """Math.min(...[...document.querySelectorAll("#drawing text")].map(
             (one) => one.getBoundingClientRect().height > 0
               ? parseFloat(getComputedStyle(one).fontSize) * one.getScreenCTM().a : 99))"""
    )
    assert smallest >= 11
    page.set_viewport_size({"width": 390, "height": 844})
    page.wait_for_function("document.documentElement.scrollWidth <= innerWidth && plan && element('scene').width < 800")


def test_a_machine_elsewhere_is_shown_with_what_perception_found(opened, free_endpoint, monkeypatch):
    mission = prepare("pledge", load_profile(), time_limit=SECONDS)
    world = SimulatedWorld(find_maze("final_2015", robot=RobotDescription()), mission.profile.robot)
    operated, robot, pages = OperatedRun(mission, pausable=True), LockstepRobot(world), Queue()
    operated.answer(b'{"kind": "advance", "ticks": 20}')
    monkeypatch.setattr("maze_machine.commands.opened_run.announce", pages.put)
    monkeypatch.setattr("maze_machine.commands.opened_run.GRACE", 0.5)
    told = network_head(run_head(mission, world), Drawings(mission.machine))
    with listening(free_endpoint) as bus, OpenRun(bus, mission, operated, told) as elsewhere:
        watchers = [elsewhere, operated]
        work = Thread(target=lambda: elsewhere.end(drive(mission, robot, robot, watchers, operator=operated)))
        viewing = Thread(target=lambda: view_remote(free_endpoint, "pico", None, "127.0.0.1", 0))
        work.start()
        viewing.start()
        page = opened(pages.get(timeout=LIMIT / 1000).address)
        page.wait_for_function("store.frames.length > 0 && store.last.tick === 19 && store.last.sights.minimap")
        assert lit(page)
        page.get_by_role("button", name="Stop the run").click()
        page.wait_for_function("element('status').textContent.includes('The base has stopped')")
        page.close()
        work.join(LIMIT / 1000)
        viewing.join(LIMIT / 1000)
        assert not work.is_alive()
        assert not viewing.is_alive()


@contextmanager
def tried(text):
    """A page on which a machine is tried."""
    library, feed = robot_names(), Feed()
    machine = hsm.loads(text, library)
    session = TriedMachine(machine, library, {}, feed.publish)
    with LivePage(tried_head(machine, {}), operate=session.answer, drawn=Drawings(machine).drawn, feed=feed) as page:
        yield page


TRIED = """machine walk

event go

var turns : int = 0

initial idle

state idle
    do stop()
    on go            -> moving

state moving
    do drive(speed = 0.2 m/s)
    when space.left  -> turning    / turns += 1

state turning
    do rotate(90 deg)
    when turns == 1  -> waiting
    on done          -> moving

state waiting
    after 3 s        -> idle
"""


def test_a_machine_is_tried_on_the_page(opened, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with tried(TRIED) as server:
        page = opened(server.address)

        def shows(state):
            page.wait_for_function(f"store.frames[app.at].doing === {state!r}")

        page.get_by_role("button", name="when event go").click()
        shows("moving")
        page.get_by_label("space.left").check()
        assert page.locator("#pending").inner_text() == "space.left"
        page.get_by_role("button", name="Microstep").click()
        shows("turning")
        page.wait_for_function("element('now').textContent.includes('microstep')")  # the next redraw
        assert "microstep 1 of 2" in page.locator("#now").inner_text()
        page.get_by_role("button", name="Microstep").click()
        shows("waiting")
        page.get_by_label("stop a wait at").fill("idle")
        page.locator("#break-form").get_by_role("button").click()
        page.get_by_label("line", exact=True).fill("after 10 s")
        page.keyboard.press("Enter")
        shows("idle")
        assert page.locator("#lines code").all_inner_texts() == ["when event go", "when space.left", "after 3 s"]
        page.locator("#save-form").get_by_role("button").click()
        page.wait_for_function("element('told').textContent.startsWith('saved')")
        assert "scenario what was tried" in (tmp_path / "walk.maze-test").read_text(encoding="utf-8")
        page.locator("#lines li").first.get_by_role("button").click()
        shows("moving")
        page.get_by_label("line", exact=True).fill("when nonsense")
        page.keyboard.press("Enter")
        page.wait_for_function("element('told').className === 'bad'")
        assert "no signal `nonsense`" in page.locator("#told").inner_text()
        assert [one["id"] for one in axe.Axe().run(page).response["violations"] if one["impact"] in SERIOUS] == []


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_nothing_serious(opened, recorded, driven, scheme):
    page = opened(f"{recorded}#t=20", color_scheme=scheme)
    page.wait_for_selector("#drawing svg g.state")
    assert serious(page) == []
    with live(driven) as (served, _, _):
        assert serious(opened(served.address, color_scheme=scheme)) == []


def serious(page):
    found = axe.Axe().run(page).response["violations"]
    return [(one["id"], [node["html"][:200] for node in one["nodes"]][:3]) for one in found if one["impact"] in SERIOUS]


def test_everything_can_be_reached_by_keyboard(opened, driven):
    with live(driven) as (served, _, _):
        page = opened(served.address)
        page.wait_for_selector("#drawing svg g.state")
        usable = "(one) => one.offsetParent && !one.disabled"
        controls = f"[...document.querySelectorAll('button, select, input')].filter({usable}).map((one) => one.id)"
        wanted = set(page.evaluate(controls))
        reached = set()
        for _ in range(120):
            page.keyboard.press("Tab")
            reached.add(page.evaluate("document.activeElement.id"))
        assert wanted <= reached


def test_the_machine_and_the_plan_are_moved_by_keyboard(opened, recorded):
    page = opened(f"{recorded}#t=20")
    page.wait_for_selector("#drawing svg g.state")
    placed = "element('drawing').querySelector('svg').style.transform"
    page.focus("#drawing")
    seen = [page.evaluate(placed)]
    for key in ("Shift+ArrowLeft", "+", "0"):
        page.keyboard.press(key)
        seen.append(page.evaluate(placed))
    assert len(set(seen[:3])) == 3
    page.focus("#scene")
    drawn = "element('scene').toDataURL()"
    pictures = [page.evaluate(drawn)]
    for key in ("Shift+ArrowUp", "+"):
        page.keyboard.press(key)
        settled(page)
        pictures.append(page.evaluate(drawn))
    assert len(set(pictures)) == 3
    assert page.evaluate(placed) == seen[3]
    page.focus("#machine-fit")
    within = (
        "(() => { const one = document.activeElement.getBoundingClientRect(), all = element('drawing')"
        ".getBoundingClientRect(); return one.right > all.left && one.left < all.right && one.bottom > all.top"
        " && one.top < all.bottom; })()"
    )
    for _ in range(1 + page.locator("#drawing g.state").count()):
        page.keyboard.press("Tab")
        assert page.evaluate(within)


def test_a_redraw_at_eight_thousand_ticks_is_quick(opened, tmp_path, driven):
    mission, world, frames, _ = driven
    many = [{**frames[at % len(frames)], "tick": at, "stamp": at * 10**8} for at in range(8000)]
    file = tmp_path / "long.html"
    file.write_text(replay_page({**run_head(mission, world), "undrawn": "not here"}, many), encoding="utf-8")
    page = opened(file.as_uri())
    page.evaluate("app.redraw(7000)")
    spent = sorted(page.evaluate("[...Array(50).keys()].map((one) => app.redraw(7000 + 10 * one))"))
    # It takes 1 to 3 ms where nothing else runs; drawing all anew took 195 ms.
    assert spent[len(spent) // 2] < 40


def test_a_run_without_a_machine_or_a_maze_is_shown(opened, tmp_path):
    frames = [
        {"tick": at, "stamp": at * 10**8, "pose": [at / 10, 0.0, 0.0], "twist": [1.0, 0.0, 0.0], "ranges": [100] * 125}
        for at in range(30)
    ]
    file = tmp_path / "bare.html"
    file.write_text(replay_page(head("</script> & <b>", RobotDescription()), frames), encoding="utf-8")
    page = opened(file.as_uri())
    assert page.title() == "</script> & <b>"
    assert page.locator("#machine").is_hidden()
    page.keyboard.press("End")
    page.wait_for_function("app.at === 29")
