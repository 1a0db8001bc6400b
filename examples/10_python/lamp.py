"""Shows the Python API: load a machine, step it, ask why a transition did not fire, save and restore the run.

$ python lamp.py
> ('off',) -> ('on', 'bright')
> when not dark: `dark` was true
> restored at 0.5 s in ['bright', 'on']
"""

import json

import hsm

TEXT = """
machine lamp

initial off

state off
    when dark -> on

state on
    initial bright
    when not dark -> off

    state bright
        after 2 s -> dim

    state dim
        stay
"""

library: hsm.Library[dict[str, bool], None] = hsm.Library("lamp")


@library.signal("dark")
def dark(facts: dict[str, bool]) -> bool:
    """Whether the lamp is needed."""
    return facts["dark"]


machine = hsm.loads(TEXT, library, "lamp.maze-machine")
run = machine.start(facts={"dark": False})
step = run.step(0.1, facts={"dark": True})
print(step.exited, "->", step.entered)

step = run.step(0.5, facts={"dark": True})
for considered in step.considered:
    print(considered)

saved = json.dumps(run.snapshot())
restored = machine.restore(json.loads(saved))
print(f"restored at {restored.time} s in {sorted(restored.configuration)}")
