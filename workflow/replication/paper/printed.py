"""The printed numbers that figures and tables draw or set beside their own, each with its source.

Lengths in m, times in s, frequencies in Hz; accelerations in g, the unit of the sensor; differences and
shares in percent, as printed. The cells of Tables 1 to 4 and all curves are not among them: no number
may be invented for what is not to be had. A reader who has the article fills them in (`paper.cells`).
"""

# names of a sensor's record: synthetic, measured, or none there
SENSORS = {True: "synthetic sensor", False: "sensor", None: "no sensor record"}
SPEEDS_RPM = (115, 150, 180, 210)


def _by_speed(*values: float) -> dict[int, float]:
    return dict(zip(SPEEDS_RPM, values, strict=True))


# The rig
TRANSMISSION_RATIO = 5.57  # 1; Sect. 5
RECORD_DURATION = 90.0  # s; Sect. 5

# Section 5: verification
LOOP_GAP = 1.1023e-10  # m; Sect. 5, text on Fig. 15
DISPLACEMENT_DIFFERENCE = 6.03  # %; Sect. 5, text on Fig. 14
DIFFERENCES = {  # %; Sect. 5, text on Table 3
    "rms": _by_speed(4.96, 8.53, 12.73, 7.02), "sd": _by_speed(5.14, 8.40, 12.09, 8.05),
}  # fmt: skip
LINES = {  # dominant peaks: Hz, g, marker; Sect. 5, text on Fig. 18
    "simulation": (_by_speed(0.122, 0.167, 0.200, 0.233), _by_speed(0.793, 1.174, 1.167, 1.162), "D"),
    "experiment": (_by_speed(0.131, 0.176, 0.2090, 0.253), _by_speed(1.083, 1.1200, 1.1720, 0.7698), "X"),
}

# Section 6.1: one engagement at 115 rpm, times as printed (their zero is not given), s
EVENTS_WITHOUT_RING = {  # text on Figs. 19 and 20
    "about to engage": 4.20, "first contact of the right arc": 4.29, "first contact of the left arc": 4.29,
    "left maximum": 4.46, "right maximum": 5.36, "right contact gone": 5.58, "out of engagement": 5.60,
}  # fmt: skip
EVENTS_WITH_RING = {  # text on Figs. 21 and 22
    "ring first touched": 4.05, "ring maximum": 4.27, "first contact of the left arc": 5.30, "left maximum": 5.47,
    "ring left": 5.48, "out of engagement": 5.56,
}  # fmt: skip

# Section 6.2: radius of the ring
RADIUS_WITHOUT_RIGHT_CONTACT = 0.305  # m; Sect. 6.2, text on Fig. 23: from there on no right-arc contact
RADIUS_CHOSEN = 0.308  # m; Sect. 6, conclusion
RADIUS_OF_STEADY_LEFT_SHARE = 0.307  # m; Sect. 6.2, text on Fig. 24
STEADY_LEFT_SHARE = 10.0  # %; Sect. 6.2, text on Fig. 24: of a sprocket turn


def lettered(title: str, rpm: float) -> str:
    """A title with the letter of the paper's panel for a motor speed (rev/min) before it, if there is one."""
    return f"({'abcd'[SPEEDS_RPM.index(rpm)]}) {title}" if rpm in SPEEDS_RPM else title


def peaks(rpm: float) -> list[tuple[str, float, float, str]]:
    """The printed dominant peaks at a motor speed: label, frequency (Hz), amplitude (g), marker."""
    return [(f"printed, {source}", hz[rpm], g[rpm], mark) for source, (hz, g, mark) in LINES.items() if rpm in hz]
