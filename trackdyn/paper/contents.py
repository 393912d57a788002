"""What belongs to a complete replication: the 24 figures and 4 tables of the paper, and those of our own.

One list: from the number of a figure to its title, its caption, the rule that makes it and the function
that draws it.
"""

from pathlib import Path

from trackdyn.paper.item import Item

PAPER = (
    Item("fig01", "The platform and its model", "schematics",
         "trackdyn.report.figures.system:system_figure", """
        The double-pin track on its wheels (a) and the model that is solved (b), drawn from the wheels' places and the
        chain laid around them without forces. Bodies are rigid and follow each other by revolute joints with bushings;
        links touch ring, idler and road wheel, the arcs of connectors touch the grooves, and the chain is coupled to
        the wheels by these contacts alone. The cross marks the joint that is cut. In (b) the wheels are drawn small so
        that the contacts can be seen.

        The paper's figure has the device and its model, too; at hand is its text, not its picture. Places and radii of
        the wheels are not in the text and are assumed or fitted. Posts, ground and hubs are for the eye only."""),
    Item("fig02", "A piece of the double-pin chain", "schematics",
         "trackdyn.report.figures.chain_piece:piece_figure", """
        Three links and two connectors: stretched (a), and with their bushings unloaded, every joint turned by five times
        the free angle (b), which would hardly be seen. Lengths, thickness, masses and inertias are those of the rig; the length of the connector follows
        from the equal-pitch radius.

        By its text the paper's figure shows a portion of the chain; its picture is lost and no dimension is printed.
        The dimensions here are assumed, apart from the connector's length, which is derived from a fitted radius. The
        diameters of pins and bushings are for the eye only: the model has no such parameter. Seen from the side a
        connector is taller than a link; it stands beside the wheels, and the model lets it touch the grooves only."""),
    Item("fig03", "Topology of the closed loop", "schematics",
         "trackdyn.report.figures.topology:topology_figure", """
        The loop as elements of the transfer matrix method, numbered along the chain as in the paper: odd numbers are
        bodies, even numbers the joints at their outputs, arrows the transfer direction. The last joint is cut. Panel
        (a) is made from the chain that is simulated unless something else is asked for, links and connectors as bodies
        of their own, of which every fifth carries its number; panel (b) from the chain with one body a pitch, which is the count that the paper prints.

        By its text the paper's figure shows the elements of (b), bodies as circles and joints as arrows. The same text
        names two kinds of body in turn, which a closed chain with an odd number of bodies cannot have."""),
    Item("fig04", "Where the chain is touched", "schematics",
         "trackdyn.report.figures.locations:locations_figure", """
        Where chain and wheels touch: the arcs of a connector and the ten areas of a groove (a), the inner face of a
        link and the rubber ring (b), the idler (c) and the road wheel (d). The connector of (a) rests symmetrically on
        its seat; the links of (b) to (d) come from the chain laid around the wheels, turned so that the contact is on
        top.

        The paper's figure has (a) and (b); its text says that (c) and (d) follow the law of (b). The shape of the
        groove is fitted, the radii of idler and road wheel are assumed. Connectors stand beside the ring and the tyres,
        here behind them."""),
    Item("fig05", "Sections of connector and groove", "schematics",
         "trackdyn.report.figures.groove:section_figure", """
        Sections of a connector (a) and of a groove (b) in the frame of the groove. The connector has two arcs of one
        radius, centred on its pins. The groove consists of ten arcs with common tangents, numbered from the left tip to
        the right one; ticks part them, dots are their centres. Solid lines are convex areas, dashed lines concave ones.

        By its text the paper's figure shows the same two sections with the same symbols. Its Table 1 is lost in the
        text at hand: radii and centres here are built from a few fitted design values. That the arcs are centred on the
        pins is assumed."""),
    Item("fig06", "Connector and groove in engagement", "schematics",
         "trackdyn.report.figures.engagement:engagement_figure", """
        The frames of the contact search (a): the inertial frame, the frame of the sprocket with its x axis through a
        tooth tip, and that of the groove with its y axis through the lowest point; C is the centre of the left arc. A
        connector on its way into the groove (b), seen from the groove, with the ways of its two pins up to the middle
        of the wrap.

        By its text the paper's figure highlights the engagement and the vectors of (a). The way in (b) is kinematic and
        comes from no run: links lie on the ring, the runs are straight, a pitch follows each groove, and the left arc
        just touches its flank once. The filled connector is at rest on the seat, which one that rides on the ring does
        not reach."""),
    Item("fig07", "Path of the arc's centre and the ten annular sectors", "schematics",
         "trackdyn.report.figures.engagement:sector_figure", """
        The trajectory of the centre of an arc that rolls over the groove (a), and the ten annular sectors between this
        trajectory and the profile (b). An arc is in contact with an area if its centre is in the area's sector. Lines
        in (b) are the ways of the two pins of a connector that passes the sprocket on its ring, by the kinematics of
        Figure 6.

        By its text the paper's figure shows trajectory and sectors of its own groove, whose numbers are lost; this one
        is fitted. The ways of the pins are an addition. Sectors of short areas are narrow and carry their number below
        the profile."""),
    Item("fig08", "How the sector of a point is found", "schematics",
         "trackdyn.report.figures.groove:detection_figure", """
        How the search tells whether the centre C of an arc is in annular sector j, for a convex area (a) and a concave
        one (b): the length of the vector e from the area's centre to C must lie between the radii of the sector, and
        its angle to the direction u must not exceed the spread angle. The cosine of the spread angle is computed
        beforehand.

        By its text the paper's figure shows the same construction. Equation 23 is lost in the text at hand and
        reconstructed from its neighbours; the groove is fitted."""),
    Item("fig09", "Contact with a convex arc", "schematics",
         "trackdyn.report.figures.contact_cases:convex_figure", """
        Contact of the left arc with a convex area: depth, normal and tangent as the contact search returns them for the
        drawn place. The force on the connector points along the normal, away from the area's centre. The depth is drawn
        far larger than any that occurs.

        By its text the paper's figure shows the left arc and area 1. Equation 29 for the depth is lost in the text at
        hand and reconstructed; the groove is fitted and the radius of the connector's arc assumed."""),
    Item("fig10", "Contact with a concave arc", "schematics",
         "trackdyn.report.figures.contact_cases:concave_figure", """
        Contact of the left arc with a concave area: depth, normal and tangent as the contact search returns them for
        the drawn place. The force on the connector points along the normal, towards the area's centre. The depth is
        drawn far larger than any that occurs.

        By its text the paper's figure shows the left arc and area 2; the equation for the depth is printed. The groove
        is fitted and the radius of the connector's arc assumed."""),
    Item("fig11", "Flow of the contact search", "schematics", "trackdyn.report.figures.flow:flow_figure", """
        The contact search as it is programmed. Each box names the function that does the step and the equations of the
        paper it stands for. The order of the areas was found by asking the search itself.

        The picture of the paper's flow chart is lost; its text describes the same steps. A difference: here each arc
        searches the groove over its own centre, where the paper searches one groove for the whole connector. Axial
        overlap and axial friction are left out with the third dimension."""),
    Item("fig12", "Cases of a link on a ring", "schematics",
         "trackdyn.report.figures.contact_cases:link_figure", """
        A link on the rubber ring: touching it with its left end (a), between its ends (b), with its right end (c). Q is
        the point of the line AB that is nearest to the sprocket's centre, P the point of the ring below it; which case
        holds is decided by s, the place where the perpendicular from the sprocket's centre meets the line AB: 0 at A
        and 1 at B. The depth is drawn far larger than any that occurs.

        By its text the paper's figure shows the same three cases. The depth is the paper's; by it the link counts as
        everything within half its thickness of AB, with round ends, which is the outline drawn here. The filled
        rectangle is the link from pin to pin. The thickness is assumed."""),
    Item("fig13", "The model in an independent code and its tooth profile", "peer",
         "trackdyn.report.figures.peer:model_figure", """
        The loop as an independent multibody code has it, and the tooth profile that it uses. The paper's figure shows
        its loop in a commercial code, whose library limits the tooth to eight arcs; that code, its model and the
        picture are not to be had. Here Exudyn takes its place: rigid bodies with three absolute coordinates each,
        revolute joints as constraints, its own implicit solver, its own spring-dampers for the bushings. Links,
        connectors, wheels, groove and start come from the same parameters, many of them assumed or fitted. Exudyn's own
        contact elements have other laws (its curve contact leaves out the speed of the sprocket's surface), so the
        contact is a force written a second time from the equations: nothing of the simulator's contact code is in it,
        but the laws are the same by intent. A second run of the first reading has eight arcs: the ten without the two tips, which is one
        reading of the paper's limit, not its profile."""),
    Item("fig14", "Vertical displacement beside the independent code", "peer",
         "trackdyn.report.figures.peer:displacement_figure", """
        Vertical displacement of the selected link in this simulator and in Exudyn, from the same settled start, and
        their difference in percent of the range, with the largest difference that the paper prints. The paragraph of
        the paper puts 180 r/min at the sprocket, while all its other figures name motor speeds; the first panel takes
        the sentence as it stands, the second takes the motor. The paper's curves are lost. Its difference is one
        between two models, with different teeth, contact laws and drives; here both codes solve one model, so a small
        difference says that chain, joints, contacts and time integration are free of mistakes that two independent
        derivations would not share. It says nothing about the parameters, which are assumed or fitted, nor about the
        real track. The sprocket's speed is prescribed in both, where the paper's other code holds it by a driving
        torque. Which link the paper selected is not printed; here it is the sensor's."""),
    Item("fig15", "Gap of the closed loop", "closure", "trackdyn.report.figures.closure:closure_figure", """
        Distance between the two ends of the loop at the joint where it is cut, at every motor speed, on a logarithmic
        axis; the broken line is the largest value that the paper prints.

        The paper's figure shows the same quantity of its own run; its curve is lost, its largest value is printed. A
        smaller gap is not a better physical result: both only show that the loop stays closed."""),
    Item("fig16", "The test set-up", "schematics", "trackdyn.report.figures.system:setup_figure", """
        The test set-up as a schematic: a motor drives the sprocket through a transmission, a wireless acceleration
        sensor sits on the selected link, and its signal is collected and sent to a computer. Chain, wheels and the
        sensor's place and axes are those of the rig.

        By its text the paper's figure shows the same parts; its picture is lost, and the records of the test are not
        public. The places of the wheels are fitted, which link carries the sensor and where it sits on the link are
        assumed; motor, boxes and posts are for the eye only."""),
    Item("fig17", "Time histories over two revolutions", "sensor_figures",
         "trackdyn.report.figures.histories:history_figure", """
        Acceleration of the instrumented link along its outward normal, over two revolutions of the loop: the simulation
        above, the sensor's record below. Both curves start at a crest of their own fundamental, because the two loops
        turn at slightly different rates.

        The paper's figure shows its simulation beside its measurement; both curves are lost. Contact with wheels and
        sprocket shows as short peaks; their height depends on the averaging over the sample interval. Single spikes of
        the sensor beyond the view are cut off at triangles, with their extremes written.""", """
        The record below is synthetic, and it was made to vary more sharply than a simulation, as the paper says of its
        measurement. It confirms nothing."""),
    Item("fig18", "Amplitude spectra", "sensor_figures", "trackdyn.report.figures.spectra:spectrum_figure", """
        Single-sided amplitude spectra of the same acceleration over the whole record. Above: the lines of the FFT around
        the loop's frequency (dotted) on the continuous spectrum that they sample, and the main lines: as the FFT shows
        them (filled), free of the picket fence (hollow), and as the paper prints them (diamond, cross). A sine between
        two lines of an FFT shows too low; the title says by how much. Middle: the lines up to 2 Hz. Below: the whole
        range, root mean square of the lines in bands.

        The paper prints frequency and amplitude of the highest line of simulation and experiment at each speed; the
        curves are lost. At the slowest speed the loop's frequency lies half way between two lines of the FFT, which
        lowers the line that is shown: the paper's low value there is of that kind. The amplitude of the simulation
        follows from the layout of the wheels, which was fitted to it.""", """
        The synthetic sensor was made to show the printed numbers of the experiment."""),
    Item("fig19", "Forces and areas without a ring", "meshing_figures",
         "trackdyn.report.figures.meshing:passage_figure", """
        Without a ring, slowest speed: normal forces on the left and right arc of one connector on its way around the
        sprocket (a), and the areas of the groove that they touch (b). Below, every event whose time the paper prints
        beside the one measured here, both after the first contact: printed (diamond, and vertical lines above), measured
        (dot), means over all passages; of a maximum that of the force after a mean over 0.01 s, the resolution of the
        printed times, and of the largest single step (cross). These times decide C16. A step far above the curves is an
        arrow at the upper edge.

        The paper's curves are lost; the order and the times of the events and the areas are printed. Which areas are
        touched was a target of the fit, the order of the maxima was not."""),
    Item("fig20", "One passage without a ring, drawn", "meshing_figures",
         "trackdyn.report.figures.screenshots:screenshot_figure", """
        Six moments of the passage of Figure 19: the connector (hatched) in its groove, with the areas numbered and the
        normal forces as arrows on one scale. The small pictures show where on the sprocket it is.

        The paper shows screenshots at the printed times. Here each moment is the event as it happens in the simulation,
        in order of time, with the printed time beside it. Maxima are those of the mean over 0.01 s; the arrow is the
        force recorded at the instant drawn, and a larger single step is named apart."""),
    Item("fig21", "Forces and areas with the ring", "meshing_figures",
         "trackdyn.report.figures.meshing:passage_figure", """
        With the ring of the paper's radius, slowest speed: normal forces on the left and right arc of one connector and
        on the link ahead of it, which the ring carries (a), and the areas touched (b). Events are marked as in Figure 19,
        from the first touch of the ring on (c); they decide C17.

        The paper's curves are lost; the order and the times of the events are printed. That the left arc touches late
        and only in one area was a target of the fit. So was the direction in which the chain runs over the sprocket,
        which decides when the ring's force is largest."""),
    Item("fig22", "One passage with the ring, drawn", "meshing_figures",
         "trackdyn.report.figures.screenshots:screenshot_figure", """
        Six moments of the passage of Figure 21: connector and the link ahead of it (hatched and dotted), the ring
        behind the teeth, the normal forces as arrows on one scale.

        The paper shows screenshots at the printed times; here each moment is the event in the simulation with the
        printed time beside it."""),
    Item("fig23", "Contact forces against ring radius and speed", "ring_figures",
         "trackdyn.report.figures.ring_study:force_figure", """
        Normal forces on an appointed connector and link over the whole run, against the radius of the ring and the
        motor speed: root mean square (a) and standard deviation (b), each for the left arc, the right arc and the ring.
        Standard errors over passages are drawn where they exceed the marks; points of different speeds
        are moved apart a little so that they do not hide each other. No ring stands at the left. Broken lines are printed
        radii: from 0.305 m on no contact of the right arc, 0.308 m to choose.

        The paper's values are lost; its text states the trends: which forces grow with the radius, which grow with
        speed, and from which radius on the right arc no longer touches. That radius and the flatness of the left arc's
        force were targets of the fit."""),
    Item("fig24", "Time in contact against ring radius and speed", "ring_figures",
         "trackdyn.report.figures.ring_study:duration_figure", """
        Time in contact as a share of a sprocket turn, against the radius of the ring and the motor speed, for the left
        arc, the right arc and the ring. Errors and vertical lines as in Figure 23.

        The paper's values are lost except for one: from a printed radius on, the left arc's contact lasts near the
        share drawn as a level line. Values at the slowest speed were targets of the fit, those at the other speeds
        were not. A share hides where on the sprocket the contact is; the phases stand beside it in `metrics.csv`."""),
    Item("table1", "The ten arcs of a groove", "parameters", "trackdyn.report.tables:table1", """
        The ten arcs of a tooth groove in the frame of the groove: centre O, radius r, unit vector u to the middle of
        the annular sector, and spread angle theta to both of its sides.

        The paper has such a table; its cells are lost. The number, order and kind (convex, concave) of the arcs are the
        paper's; the sizes are this replication's own, assumed or fitted so that the areas and durations of contact come
        out as printed.""", table=True),
    Item("table2", "Computing times", "peer", "trackdyn.peers.comparison:compare", """
        What one simulated second costs in both codes on this machine, with one thread, wall and processor time of the
        integration alone (settling, assembling and compiling not counted). A comparison of speed means little without
        one of accuracy: every step of a ladder is run, and its error taken in the vertical displacement of the selected
        link against the same code's own finest run, the largest over the record in percent of the range; 'chosen' marks
        the largest step below the stated error. Exudyn is general and three- dimensional at heart, solves for all
        coordinates and joint forces with an implicit method, and calls the contact force from Python, compiled; this
        simulator has one loop, one purpose and an explicit step. The ratio is therefore no verdict on either. The paper
        prints only that its method was a little faster than the commercial code, on another machine; the cells of its
        table are lost and stay empty.""", table=True),
    Item("table3", "RMS and standard deviation", "statistics", "trackdyn.report.tables:table3", """
        Root mean square and standard deviation of the link's acceleration, simulation and sensor, at every speed, with
        the standard error of each over revolutions of the loop and the value difference (simulation - sensor) / sensor
        without its sign.

        The paper's cells are lost; its differences in percent are printed and stand here under a name that says so.
        They are against its own measurement: they cannot be compared with those of another record.""", """
        The sensor's record is synthetic: its RMS and SD are its own.""", table=True),
    Item("table4", "A coarser tooth contact", "coarse_table", "trackdyn.report.tables:table4", """
        Root mean square and standard deviation with a tooth of three surfaces (left, seat, right; of the kind in Ref.
        [2]) beside the tooth of ten arcs, all else equal, with standard errors over revolutions of the loop and passages.

        The paper concludes from its measurement that a coarser contact is less accurate; cells and measurement are
        lost. This table shows only what the coarser contact changes, not which is right.""", table=True),
)
# made by every run
OWN = (
    Item("loop", "The loop on its wheels", "loop_figure", "trackdyn.report.figures.loop:loop_figure", """
        The loop on its wheels at the first configuration of a record: whole (a), around the sprocket (b), and one
        groove with the numbers of its ten areas (c). Drawn from the geometry that the simulator uses.

        This picture is ours; the paper has none like it. The layout of the wheels is fitted to printed results and the
        shape of the groove is this replication's own."""),
    Item("sensor_records", "The sensor's records", "sensor_records", "trackdyn.sensor.sensor_csv:read_sensor_csv", """
        What reading the sensor's files did: rows, columns with their units, time stamps, rate, and what was dropped, averaged,
        resampled or found at the end of the range. The records as they are compared stand in `sensor` of the results.""",
         table=True),
    Item("claims", "The scorecard as a picture", "claims",
         "trackdyn.report.figures.scorecard:scorecard_figure", """
        Every claim of the paper with its parts: the printed number, the number measured here, and the verdict.
        Reproduced: within the tolerance; in trend: within a wider one, or at some starts of the record; not reproduced:
        neither. No test: shown, but no run of a sound program could fail it. Not comparable: the printed value or the
        data behind it are lost, or what it needs was not run. Where the paper has only words, the bound is what they were
        taken as: ours.

        Predicted: an open test; follows: implied by a fitted claim or by kinematics; fitted: a target of the fit, or a
        parameter was chosen by looking at it. A claim comes out if all of its judged parts do. Tolerances stand in
        `config/claims.yaml` with their reasons, and which of them were set when results were known."""),
    Item("sensitivity", "What moves when a fitted parameter moves", "sensitivity",
         "trackdyn.report.figures.sensitivity:sensitivity_figure", """
        How far the measures behind the claims move when one fitted parameter moves (a log-scaled one by a factor of
        1.2, another by a tenth of its range) and the rest is held, in units of the tolerance of each target. A column
        of small numbers is a parameter that these claims do not determine; a row of large numbers is a claim that rests
        on the fit.

        The paper has nothing like it: its parameters are not printed, so they were fitted here."""),
    Item("animation", "The loop in motion", "animation",
         "trackdyn.report.figures.animation:write_animation", """
        One turn of the sprocket in slow motion, the sprocket above and the whole loop below. Arrows are normal forces
        as the simulation had them at that instant: on the left arc (round), the right arc (square), and by the ring on
        the link (triangle). Ours, not the paper's."""),
    Item("lines", "Main lines of the spectra", "statistics", "trackdyn.report.tables:lines_table", """
        Main line of the acceleration at every speed: as the FFT shows it, free of the picket fence, and as the paper
        prints it, with standard errors over revolutions of the loop; the frequency of a bin of the FFT is known to its
        width. Beside the sensor's record stands the number of the paper's experiment.""", """
        The synthetic sensor was made to show the paper's experimental numbers, so that their agreement says
        nothing.""", table=True),
    Item("parameters", "Every parameter with its kind and source", "parameters",
         "trackdyn.parameters.rig:parameter_table", """
        Every parameter of the rig with its unit, kind and source. Printed: stands in the paper; derived:
        follows from printed numbers; assumed: not in the paper; fitted: chosen so that the model shows a
        printed result.""", table=True),
    Item("fit_targets", "Targets of the fit", "sensitivity", "trackdyn.inference.fit:report_targets", """
        What the fit aimed at and what the rig gives, in units of each tolerance. Targets that were held out were not
        fitted.""", table=True),
    Item("equal_pitch", "Two readings of equal pitch", "sensitivity", "trackdyn.inference.fit:equal_pitch_readings", """
        The two readings of "equal pitch at 0.308 m" put into the rig, all else held, beside the fitted one: shares of
        the left and the right arc, % of a sprocket turn. A dash: the loop does not settle in that case.""", table=True),
    Item("run_direction", "Both ways in which the chain may run", "sensitivity",
         "trackdyn.inference.fit:run_directions", """
        Times of the events of one passage with the chain descending and climbing on the sprocket, all else held. The
        paper does not say which way its chain runs; it prints the ring's maximum at 0.22 s (C17) and the right arc's
        without a ring at 1.07 s (C16).""", table=True),
    Item("stability", "Stability of the statistics", "stability", "trackdyn.study.stability:stability", """
        What half the time step, twice the record and a later start change in the statistics, beside their tolerances:
        of shares in points of a turn, of all else relatively.""", table=True),
    Item("fidelity", "The ladder of fidelities", "fidelity", "trackdyn.report.tables:ladder_table", """
        Every setting of the ladder of fidelities beside the paper's fidelity, one choice changed at a time: differences
        of RMS, SD, main line and mean peak of the left arc in percent, of contact shares in points of a sprocket turn;
        largest gap of the loop in m; wall seconds per simulated second of one run. The paper has no such table. All
        runs are simulations; no measured data enter.""", table=True),
    Item("costs", "What each rule cost", "costs", "", """
        Wall time, processor time and largest memory of every rule, as each job wrote them at its end, with their
        total. Jobs share the machine, so wall times depend on what ran beside them. What is asked for by name stands
        below the total if it was run before.""", table=True),
    Item("traction", "Which flank carries drive", "traction", "trackdyn.report.figures.traction:traction_figure", """
        Share of a sprocket turn in which the left and the right arc touch, over the creep slope of the ring's friction
        (coefficient over transition velocity) and the ring's radius, at 115 rpm; once with the coefficient of the other
        wheels and once with their transition velocity. With much traction the ring runs ahead of the chain and drives:
        the left arc lets go and the right one holds back. The marks are the ring of this rig and its other wheels."""),
)
# asked for by name
STUDIES = (
    Item("trade", "Accuracy against cost", "trade", "trackdyn.report.figures.trade:work_precision", """
        Accuracy against cost: error of the state after a short window and of the statistics of a record over fidelity,
        integrator and step, and the planner's promises on scenes that its data do not hold. Errors
        are taken against the limit over steps of the same model, so they say nothing about the model itself. Processor seconds
        are those of the machine that ran it; only their ratios mean anything elsewhere. The paper has no such figure; it
        only says that its step was chosen for efficiency."""),
    Item("trade_answer", "What an answer costs", "trade", "trackdyn.report.figures.trade:answer_figure", """
        What the mean peak force of the left arc can be off at most against the processor time for all of the answer: settling,
        starting, three seconds at constant speed, and the record. Every curve is a setting of model, method and step; along it
        the duration grows from nine passages to ten minutes. A curve falls while scatter is what is off, and lies
        level where the setting is. Marks stand at both ends of a curve. Where motion repeats the shortest record is enough,
        and the step decides.""", ),
    Item("limits", "How far each preset is from the limit", "trade", "trackdyn.study.accuracy.limit:presets_beside_limits", """
        Measures at a step of zero, extrapolated over steps, and how far the presets are off with their own steps, each
        with its standard error: percent, of contact shares points of a sprocket turn. A dash: that step was refused or was not
        run. Whether the preset `standard` is within 2 % is undecided where two standard errors decide it. The paper
        has no such table.""", table=True),
    Item("peer_answers", "An answer of equal error in every code", "peer_answers", "trackdyn.peers.answers:compare_answers", """
        Processor seconds until the RMS of the acceleration of all links is known to 1 %, with the ring of 0.308 m at 115 rpm, in
        this simulator, in Exudyn and in MuJoCo, on one thread of one machine in one run: settling or assembling, starting, leaving
        half a second out, and recording as many passages as the setting's error and scatter leave to be averaged. Each code's
        error is taken against its own limit over steps, extrapolated with the order of its method, and each is chosen at its own
        cheapest setting of those tried; a dash: too coarse for the tolerance. This simulator and Exudyn solve one model with the
        same contact laws, which Exudyn calls from Python, compiled. MuJoCo has a contact of its own, matched to the rig's at one
        load, so it solves another model of the same layout. Both are general and three-dimensional: ratios are no verdict on
        them.""", table=True),
    Item("scaling", "A sweep on more processes", "scaling", "trackdyn.report.figures.trade:scaling_figure", """
        Wall time of equal runs on one and two processes, the least of three repetitions, beside a model that knows the time of
        one run alone."""),
    Item("extremes", "Extremes", "extremes", "trackdyn.study.extremes.judge:summary", """
        Extremes of parameters, speeds, steps and initial states. A case completes with its invariants in bounds (finite
        numbers, loop gap, energy residual, momentum, symmetry) or is refused in one sentence that names the cause; any
        third way would be a defect and is counted as one.""", table=True),
    Item("extremes_solvers", "Solvers to their limits", "extremes",
         "trackdyn.report.figures.extremes:solvers_figure", """
        Error of the angular accelerations against extended precision up to 70 bodies (a), and the residual of the
        equations of motion beyond (b). The literal product of transfer matrices loses a constant number of digits a body, as its
        closed form predicts; a scene refuses it before half of the digits are gone."""),
    Item("extremes_stability", "Stable and unstable steps", "extremes",
         "trackdyn.report.figures.extremes:stability_figure", """
        Explicit integration forced past the refusal of the scene, over step and stiffness of the teeth, beside the
        limit that is predicted when a model is built."""),
    Item("extremes_restitution", "Restitution that is delivered", "extremes",
         "trackdyn.report.figures.extremes:restitution_figure", """
        Restitution that one impact delivers against the nominal one. The law as printed never delivers less than
        0.66."""),
    Item("extremes_outcomes", "How the cases ended", "extremes",
         "trackdyn.report.figures.extremes:outcomes_figure", """
        How the cases of every family ended: completed with every invariant in bounds, refused in one sentence, or
        neither."""),
    Item("extremes_long_run", "A long run", "extremes", "trackdyn.report.figures.extremes:long_run_figure", """
        A long run in chunks of whole revolutions of the loop: largest loop gap, open share of the account of work, RMS
        of the sensor's y acceleration (Eq. 40, as in Table 3), and the largest memory used so far."""),
)


def missing(results: Path | str) -> list[Item]:
    """The figures and tables of the paper that a results folder lacks, in the paper's order."""
    return [item for item in PAPER if not item.files(results)]


def caption(key: str, synthetic: bool = True) -> str:
    """Caption of a figure or table after its label: what stands above a written table."""
    (item,) = (item for item in (*PAPER, *OWN, *STUDIES) if item.key == key)
    return (f"{item.label}. " if item.label else "") + "\n\n".join(item.caption(synthetic))
