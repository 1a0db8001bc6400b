"""Random valid machines, as text, for property tests."""

from __future__ import annotations

from hypothesis import strategies as st

CONDITIONS = st.recursive(
    st.sampled_from(
        [
            "space.left",
            "space.front",
            "door.near",
            "clear(0.5 m)",
            "clear(distance=20cm)",
            "ahead<1m",
            "ahead   >= near",
            "steps == 3",
            "n*2 > m-1",
            "(n / 2) > 1.5",
            "junction.kind == dead_end",
            "side != left",
            "abs( heading )<5 deg",
            "min(ahead,near)<1 m",
            "(ahead if space.left else near)<1m",
            "(n if (m>0 or space.left) else 2*n)==3",
            "(junction.kind if space.front else dead_end) == corner",
            "busy",
            "pace == quick",
            "true",
        ]
    ),
    lambda inner: st.one_of(
        st.builds("not ({})".format, inner),
        st.builds("({} and {})".format, inner, inner),
        st.builds("({} or\n            # why\n   {})".format, inner, inner),
        st.builds("( {}  or {} )".format, inner, inner),
    ),
    max_leaves=5,
)
MORE_ACTIONS = [
    "n = n if space.left else m+1",
    "raise lift( 1m,up=true , side=left )",
    "raise lift(near, n>2, side) after 2s",
    "cancel lift",
    "send lift(height=1m, up = false,side=side)",
    "send go",
    "pace=quick",
]
CARRIED = ["lift.up", "lift.height>1m", "not (lift.side == left)", "(lift.height if lift.up else near) < 2 m"]
ACTIONS = st.lists(
    st.sampled_from(["n+=1", "m = n*2 -1", "door.remember( )", "beep(2)", "raise go", "n = -3", *MORE_ACTIONS]),
    min_size=1,
    max_size=3,
).map(lambda actions: " / " + ",".join(actions))
COMMENTS = st.sampled_from(["", "", "", "  # a remark", " #tight"])
ACTIVITIES = st.sampled_from(["rotate( 90deg )", "ring()", "wait(duration=2s,times= 3)", "align(  side=left)"])


@st.composite
def machines(draw: st.DrawFn) -> str:
    """The text of a machine that is right, laid out carelessly."""
    count = draw(st.integers(1, 6))
    names = [f"s{number}" for number in range(count)] + ["end"]
    lines = [
        "#top",
        "machine   m  # name",
        "",
        "event go,stop",
        draw(st.sampled_from(["param near:length=0.5m", "param near:length=0.5m ,adjustable( 0.1m,2 m )"])),
        draw(st.sampled_from(["param side : Side=right #c", "param side : Side=right,adjustable #c"])),
    ]
    lines += ["", "", "var n:int=0", "var m : int = -1", ""]
    lines += [
        "event lift(height:length,up:bool, side : Side)",
        "enum Pace = slow,quick",
        "expose n,pace",
        "var pace:Pace = slow",
        "define busy = n>1 and (pace==quick or m<0)",
        "entry / raise lift(1m, n>0 ,side) after 90s",
        "",
    ]
    previous = 0
    for number in range(count):
        depth = draw(st.integers(0, previous + 1)) if number else 0
        previous = depth
        pad = "   " * depth
        if draw(st.booleans()):
            lines.append(f"{' ' * draw(st.integers(0, 9))}# before")
        lines.append(f"{pad}state  {names[number]}{draw(COMMENTS)}")
        pad += "   "
        lines.append(f"{pad}do {draw(ACTIVITIES)}{draw(COMMENTS)}" if depth == 0 and count == 1 else f"{pad}do wait()")
        for _ in range(draw(st.integers(0, 3))):
            trigger = draw(
                st.one_of(
                    st.sampled_from(["on go", "on go,stop", "on done", "on fault", "on lift", "on *", "defer"]),
                    st.builds("when {}".format, CONDITIONS),
                    st.builds("when {} for  0.5s".format, CONDITIONS),
                    st.sampled_from(
                        ["after 5s", "after (near / 0.5 m/s)", "every 2s", "after (1s if space.left else 2 s)"]
                    ),
                )
            )
            carried = [st.builds(" if {}".format, st.sampled_from(CARRIED))] if trigger == "on lift" else []
            guard = draw(st.one_of(st.just(""), st.builds(" if {}".format, CONDITIONS), *carried))
            target = draw(
                st.one_of(
                    st.just(""), st.builds("{}{}".format, st.sampled_from(["->", " =>  "]), st.sampled_from(names))
                )
            )
            actions = draw(ACTIONS) if not target or draw(st.booleans()) else ""
            if trigger == "defer":
                lines.append(f"{pad}defer {draw(st.sampled_from(['lift', 'go,stop', '*']))}{guard}{draw(COMMENTS)}")
                continue
            lines.append(f"{pad}{trigger}{guard} {target}{actions}{draw(COMMENTS)}")
        if draw(st.booleans()):
            lines.append(f"{pad}entry {draw(ACTIONS).strip()}")
        lines += [""] * draw(st.integers(0, 3))
    lines.append("final end")
    return "\n".join(lines)
