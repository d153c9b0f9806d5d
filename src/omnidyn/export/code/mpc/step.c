/* A step: observe, look past the delay, predict, solve, remember. The equations: omnidyn/control/mpc/loop.py, guess.py,
   limits.py, observer.py, program.py. */

/* What a measured state (pose, twist) says of the state, the push on each axis, and the share of its friction: a Kalman
   filter with three states for each axis, and one for each entry of the pose. */
#if AVERAGED || SUM
/* The mean of the twist over a step from `before`, as encoders count it. */
static void mean_twist(const omnidyn_control *c, const float before[6], const float *pose, float mean[3])
{
    const float turn = 0.25f * (before[5] + pose[5]) * STEP;
    const float per = 1.0f / ((1.0f - turn * turn / 6.0f) * STEP);
    seen(c->base[2] + before[2] + turn, per * (pose[0] - before[0]), per * (pose[1] - before[1]), mean);
    mean[2] = (pose[2] - before[2]) / STEP;
}
#endif

#if SUM
/* Add to the push what the sum of the speed loop gains in a step under a drive, with this mean of the twist. */
static void sum_up(omnidyn_control *c, const float *drive, const float *mean)
{
    int i;
    ROLLED for (i = 0; i < 3; i++) {
        c->believed[2][i] += STEP * (dot3(SUM_DRIVE[i], drive) - dot3(SUM_TWIST[i], mean));
    }
}
#endif

#if (AVERAGED || SUM) && !LEARN
/* Without an observer: what is measured, but the twist at which a step ends where its mean was measured. */
static void follow(omnidyn_control *c, const float *measured, int known)
{
    float before[6], mean[3];
    int i;
    memcpy(before, c->believed, sizeof(before));
    run_on(c, c->believed[0], c->sent[0]);
    mean_twist(c, before, c->believed[0], mean);
#if SUM
    if (known) {
        sum_up(c, c->sent[0], mean);
    }
#endif
    ROLLED for (i = 0; i < 3; i++) {
        c->believed[0][i] = measured[i];
        c->believed[1][i] = measured[3 + i] + (known && AVERAGED ? c->believed[1][i] - mean[i] : 0.0f);
    }
}
#endif

#if LEARN
static void observe(omnidyn_control *c, const float *measured, int known)
{
    float force[4][3];
    int i, j, q;
#if AVERAGED
    float moved[3], middle;
#endif
#if AVERAGED || SUM
    float before[6], mean[3];
    memcpy(before, c->believed, sizeof(before));
#endif
    run_on(c, c->believed[0], c->sent[0]);
#if AVERAGED || SUM
    mean_twist(c, before, c->believed[0], mean);
#endif
#if SUM
    if (known) {
        sum_up(c, c->sent[0], mean);
    }
#endif
#if AVERAGED
    middle = c->base[2] + 0.5f * (before[2] + c->believed[0][2]);
#endif
    friction_at(c->believed[1], PLAIN, force);
    ROLLED for (i = 0; i < 3; i++) {
        float(*p)[3] = c->spread[i], *twist = &c->believed[1][i];
#if AVERAGED
        const float begin = p[0][0], left = MISSING ? 0.0f : measured[3 + i] - mean[i];
        float across[3];
#else
        float *place = &c->unsure[i], *pose = &c->believed[0][i];
        const float left = MISSING ? 0.0f : measured[3 + i] - *twist, off = MISSING ? 0.0f : measured[i] - *pose;
#endif
        const float by[3] = {c->columns[0][1 + i][3 + i], PHI(i)[i], -PHI(i)[i] * force[0][i]};
        float r, gain[3];
        ROLLED for (j = 0; j < 3; j++) {
            p[0][j] = by[0] * p[0][j] + by[1] * p[1][j] + by[2] * p[2][j];
        }
#if AVERAGED
        ROLLED for (j = 0; j < 3; j++) {
            across[j] = p[j][0];
        }
#endif
        ROLLED for (j = 0; j < 3; j++) {
            p[j][0] = dot3(by, p[j]);
            p[j][j] += (float)known * WALK[j][i];
        }
#if AVERAGED /* what is measured is (twist + twist+)/2 */
        moved[i] = 0.25f * (begin + 2.0f * across[0] + p[0][0]);
        r = known ? 1.0f / (moved[i] + NOISE[i]) : 0.0f;
        moved[i] *= STEP * r * left;
        ROLLED for (j = 0; j < 3; j++) {
            across[j] = 0.5f * (across[j] + p[j][0]);
            gain[j] = across[j] * r;
            c->believed[1 + j][i] += gain[j] * left;
        }
        ROLLED for (j = 0; j < 3; j++) {
            ROLLED for (q = 0; q < 3; q++) {
                p[q][j] -= gain[q] * across[j];
            }
        }
#else
        r = known ? 1.0f / (p[0][0] + NOISE[i]) : 0.0f;
        ROLLED for (j = 0; j < 3; j++) {
            gain[j] = p[j][0] * r;
            c->believed[1 + j][i] += gain[j] * left;
        }
        ROLLED for (j = 0; j < 3; j++) {
            ROLLED for (q = 2; q >= 0; q--) {
                p[q][j] -= gain[q] * p[0][j];
            }
        }
#endif
        r *= left * left;
#if OMNIDYN_FEW_KNOCKS
        c->knocks[i] *= KNOCK_MEMORY;
        if (r > KNOCK && c->knocks[i] < MOST_KNOCKS) { /* a push that nobody expected */
            c->knocks[i] += 1.0f;
#else
        if (r > KNOCK) { /* a push that nobody expected */
#endif
            p[1][1] += left * left / (by[1] * by[1]);
        }
        c->believed[3][i] = c->believed[3][i] > 0.0f ? c->believed[3][i] : 0.0f;
        c->believed[3][i] = c->believed[3][i] < MOST_SCALE ? c->believed[3][i] : MOST_SCALE;
        if (!known || !(r <= FARTHEST_OFF)) { /* a robot that was moved */
#if AVERAGED
            *twist = known ? *twist + (1.0f - gain[0]) * left : measured[3 + i];
#else
            *twist = measured[3 + i];
#endif
            ROLLED for (j = 0; j < 3; j++) {
                p[0][j] = p[j][0] = 0.0f;
            }
            p[0][0] = NOISE[i];
        }
#if AVERAGED
    }
    seen(-middle, moved[0], moved[1], mean);
    mean[2] = moved[2];
    ROLLED for (i = 0; i < 3; i++) {
        float *place = &c->unsure[i], *pose = &c->believed[0][i], r, gain[1];
        const float off = MISSING ? 0.0f : measured[i] - *pose - mean[i];
        *pose += mean[i];
#endif
        *place += WALK[3][i];
        r = 1.0f / (*place + POSE_NOISE[i]);
        gain[0] = known && off * off * r <= FARTHEST_OFF ? *place * r : 1.0f;
        *pose += gain[0] * off;
        *place = gain[0] * POSE_NOISE[i];
    }
}
#endif

/* The path from the base on: poses relative to it, and twists in the frame of the body. */
static void take_path(omnidyn_control *c, const omnidyn_motion *path)
{
    float heading = 0.0f;
    int k;
    for (k = 0; k <= OMNIDYN_HORIZON; k++, path++) {
        float *goal = c->goal[k];
        goal[0] = path->pose[0] - c->base[0];
        goal[1] = path->pose[1] - c->base[1];
        heading += remainderf(path->pose[2] - c->base[2] - heading, TURN);
        goal[2] = heading;
        seen(path->pose[2], path->velocity[0], path->velocity[1], goal + 3);
        goal[5] = path->velocity[2];
    }
}

/* The motion along which the step is made linear: that of the step before, shifted by one; the path where none was. */
static void guess(omnidyn_control *c, int known)
{
    int i;
    if (known) {
        memmove(c->x[0], c->x[1], sizeof(c->x) - sizeof(c->x[0]));
        memmove(c->input, c->input + OMNIDYN_WHEELS, sizeof(c->input) - OMNIDYN_WHEELS * sizeof(c->input[0]));
    } else {
        memcpy(c->x, c->goal, sizeof(c->x));
    }
    for (i = known ? INPUTS - OMNIDYN_WHEELS : 0; i < INPUTS; i++) {
        c->input[i].active = 0;
    }
}

/* Where robot and path stand still, the motion predicted last is no guess: it stays. */
static void stay_at_rest(omnidyn_control *c)
{
    int k, i;
    for (k = 0; k <= OMNIDYN_HORIZON; k++) {
        ROLLED for (i = 0; i < 3; i++) {
            if (fabsf(c->x[0][3 + i]) >= NEAR[i] || fabsf(c->goal[k][3 + i]) >= NEAR[i]) {
                return;
            }
        }
    }
    for (k = 1; k <= OMNIDYN_HORIZON; k++) {
        memcpy(c->x[k], c->x[0], 3 * sizeof(float));
        memset(c->x[k] + 3, 0, 3 * sizeof(float));
    }
}

#if BOUNDED
/* Bounds of the volts: of voltage, of current at the speed predicted, of what can be reached by then. */
static void make_bounds(omnidyn_control *c)
{
    int j;
    for (j = 0; j < INPUTS; j++) {
        const int i = j % OMNIDYN_WHEELS;
        float low = -VOLTAGE_LIMIT(i), high = VOLTAGE_LIMIT(i);
#if SLEW
        {
            const float last = c->slewed[i], reach = SLEW_STEP * (float)(j / OMNIDYN_WHEELS + 1);
            low = low > last - reach ? low : last - reach;
            high = high < last + reach ? high : last + reach;
        }
#endif
#if CURRENT
        {
            const float middle = 0.5f * (high + low), most = CURRENT_VOLTS[i];
            const float off = dot3(EMF[i], c->x[j / OMNIDYN_WHEELS] + 3) - middle;
            const float free = middle + within(off, 0.5f * (high - low) + most);
            low = low > free - most ? low : free - most;
            high = high < free + most ? high : free + most;
        }
#endif
        if (high - low < NARROWEST) {
            low = within(0.5f * (low + high - NARROWEST), VOLTAGE_LIMIT(i) - NARROWEST);
            high = low + NARROWEST;
        }
        c->input[j].bound[0] = low;
        c->input[j].bound[1] = high;
    }
}
#endif

/* Volts within the bounds of an input. */
static float bounded(float volts, const omnidyn_input *input)
{
    volts = volts < BOUND(1, input) ? volts : BOUND(1, input);
    return volts > BOUND(0, input) ? volts : BOUND(0, input);
}

/* The inputs that the path asks for, friction and push included, and the way back to it. */
static void make_costs(omnidyn_control *c)
{
    int k, i;
    for (k = 0; k < OMNIDYN_HORIZON; k++) {
        const float *now = c->goal[k], *then = c->goal[k + 1], *x = c->x[k];
        float way[3], wanted[3], force[4][3];
        seen(c->base[2] + x[2], now[0] - x[0], now[1] - x[1], way);
        way[2] = now[2] - x[2];
        ROLLED for (i = 0; i < 3; i++) {
            way[i] = HOME[i] * (way[i] - within(way[i], ARRIVED[i]));
            c->way[k][i] = within(way[i], NEAR[i]);
            way[i] += 0.5f * (now[3 + i] + then[3 + i]);
            wanted[i] = then[3 + i] - dot3(GAINS[i], now + 3);
        }
        friction_at(way, PLAIN, force);
        ROLLED for (i = 0; i < 3; i++) {
            way[i] = dot3(FEED[i], wanted) + c->believed[3][i] * force[0][i] - c->believed[2][i];
        }
#if TURNING
        {
            const float middle[3] = {0.5f * (now[3] + then[3]), 0.5f * (now[4] + then[4]), 0.5f * (now[5] + then[5])};
            frame_at(middle, force[0]);
            ROLLED for (i = 0; i < 3; i++) {
                way[i] -= force[0][i];
            }
        }
#endif
        ROLLED for (i = 0; i < OMNIDYN_WHEELS; i++) {
            omnidyn_input *input = &c->input[OMNIDYN_WHEELS * k + i];
            input->wanted = bounded(dot3(PULL[i], way), input);
        }
    }
}

/* All steps along the motion predicted in x; what rests meets friction against the way back to the path. */
static void make_stages(omnidyn_control *c)
{
    int k, i;
    for (k = 0; k < OMNIDYN_HORIZON; k++) {
        float sense[3];
        ROLLED for (i = 0; i < 3; i++) {
            sense[i] = c->x[k + 1][3 + i] + c->way[k][i];
        }
        linear_stage(c, c->x[k], c->x[k + 1] + 3, sense, SOFT, c->columns[k]);
    }
}

/* Whether the prediction differs from the one it was made along: other friction, another heading. */
static int has_moved(const omnidyn_control *c)
{
    int k;
    for (k = 0; k < OMNIDYN_HORIZON && k < SOON - 1; k++) {
        const float *x = c->x[k + 1] + 2, *before = c->before[k] + 2;
        if (fabsf(x[0] - before[0]) > TURNED) {
            return 1;
        }
#if LEVELS
        int e;
        for (e = 0; e < LEVELS; e++) {
            const float *own = LEVEL[e], r = 1.0f / own[8];
            if (fabsf(within(r * dot3(own, x + 1), 1.0f) - within(r * dot3(own, before + 1), 1.0f)) > MOVED) {
                return 1;
            }
        }
#endif
#if CURRENT
        int i;
        ROLLED for (i = 0; i < OMNIDYN_WHEELS; i++) {
            if (fabsf(dot3(EMF[i], x + 1) - dot3(EMF[i], before + 1)) > PULLED) {
                return 1;
            }
        }
#endif
    }
    return 0;
}


/* Whether all of n numbers are finite, and none is beyond what a place or a speed can be. */
static int sane(const float *values, int n)
{
    while (n-- > 0) {
        if (!(fabsf(values[n]) <= FARTHEST)) {
            return 0;
        }
    }
    return 1;
}

#if !LEARN
/* What is expected to be measured, in place of what is no number. */
static void expect(omnidyn_control *c, float measured[6])
{
    float before[6], after[6];
    int i;
    memcpy(before, c->believed, sizeof(before));
    run_on(c, c->believed[0], c->sent[0]);
    memcpy(after, c->believed, sizeof(after));
#if AVERAGED
    mean_twist(c, before, c->believed[0], after + 3);
#endif
    memcpy(c->believed, before, sizeof(before));
    ROLLED for (i = 0; i < 6; i++) {
        measured[i] = MISSING ? after[i] : measured[i];
    }
}
#endif

/* What is wanted of a step in volts: row 0 of u. Its numbers are sane, but for a measurement that is to be bridged. */
static void control(omnidyn_control *c, const float *pose, const float *twist, const omnidyn_motion *path, int known)
{
    float measured[6];
    int k, i, again;
#if SUM
    float push[3]; /* now: the steps ahead are made with that of when the output acts */
#endif
    ROLLED for (i = 0; i < 3; i++) { /* all poses are relative to where the path begins: small numbers are exact */
        const float from = path[0].pose[i];
        float by = from - c->base[i];
        by = i == 2 ? remainderf(by, TURN) : by;
        c->base[i] = from;
        c->believed[0][i] -= by;
        for (k = 0; k <= OMNIDYN_HORIZON; k++) {
            c->x[k][i] -= by;
        }
        measured[i] = pose[i] - from;
        measured[3 + i] = twist[i];
    }
    measured[2] = remainderf(measured[2], TURN);
    take_path(c, path);
    guess(c, known);
#if OMNIDYN_ELAPSED && LATE_STEPS
    if (c->step > LATEST * OMNIDYN_DT) { /* a step was missed: what was sent last held on */
        ROLLED for (i = 0; i < 3; i++) {
            c->sent[0][i] = 0.5f * (c->sent[0][i] + c->sent[1][i]);
        }
        memmove(c->sent[1], c->sent[LATE_STEPS > 1 ? 2 : 1], (LATE_STEPS - 1) * sizeof(c->sent[0]));
    }
#endif
#if LEARN
    observe(c, measured, known);
    memcpy(c->x, c->believed, sizeof(measured));
#elif AVERAGED || SUM
    expect(c, measured);
    follow(c, measured, known);
    memcpy(c->x, c->believed, sizeof(measured));
#else
    expect(c, measured);
    memcpy(c->believed, measured, sizeof(measured));
    memcpy(c->x, measured, sizeof(measured));
#endif
#if OMNIDYN_ELAPSED
    hold_for(c, OMNIDYN_DT);
#endif
#if SUM
    memcpy(push, c->believed[2], sizeof(push));
#endif
    for (k = 1; k <= LATE_STEPS; k++) {
#if SUM
        float before[6], mean[3];
        memcpy(before, c->x[0], sizeof(before));
#endif
        run_on(c, c->x[0], c->sent[k]);
#if SUM
        mean_twist(c, before, c->x[0], mean);
        sum_up(c, c->sent[k], mean);
#endif
    }
    stay_at_rest(c);
#if BOUNDED
    make_bounds(c);
#endif
    make_costs(c);
    for (again = AGAIN;;) {
        memcpy(c->before, c->x[1], sizeof(c->before));
        make_stages(c);
        solve(c);
        if (--again == 0 || !has_moved(c)) {
#if SUM
            memcpy(c->believed[2], push, sizeof(push));
#endif
            return;
        }
        for (k = 0; k < OMNIDYN_HORIZON; k++) { /* half-way between two predictions */
            float *x = c->x[k + 1];
            ROLLED for (i = 3; i < 6; i++) {
                x[i] = 0.5f * (x[i] + c->before[k][i]);
            }
        }
#if BOUNDED
        make_bounds(c);
#endif
    }
}

void omnidyn_control_reset(omnidyn_control *c)
{
    int i;
    memset(c, 0, sizeof(*c));
    ROLLED for (i = 0; i < 3; i++) {
        c->believed[3][i] = 1.0f;
#if LEARN
        c->spread[i][1][1] = START_PUSH * START_PUSH * WALK[1][i];
        c->spread[i][2][2] = START_SCALE * START_SCALE;
#endif
    }
}

int omnidyn_control_step(omnidyn_control *c, float elapsed, const float pose[3], const float twist[3],
                         const omnidyn_motion path[OMNIDYN_HORIZON + 1], float output[OMNIDYN_WHEELS])
{
    const int known = c->known && elapsed > 0.5f * OMNIDYN_DT && elapsed < LONGEST * OMNIDYN_DT;
    int i, j, says = OMNIDYN_OK, bridged = OMNIDYN_OK, swinging = 0;
    if (c->begun && elapsed == 0.0f) {
        memcpy(output, c->last, sizeof(c->last));
        return OMNIDYN_STILL;
    }
    if (!sane(twist, 3)) {
        says = OMNIDYN_BAD_TWIST;
    }
    if (!sane(pose, 3)) {
        says = OMNIDYN_BAD_POSE;
    }
#if LATE_ROWS
    float now[3];
    if (elapsed >= 0.0f && elapsed <= FARTHEST) {
        if (says == OMNIDYN_OK) {
            pose_now(&c->late, elapsed, pose, twist, now);
            pose = now;
        } else {
            c->late.waited += elapsed;
        }
    }
#endif
#if OMNIDYN_MOST_BRIDGED
    c->missing = says ? c->missing + 1 : 0;
    if (known && elapsed < LATEST * OMNIDYN_DT && c->missing <= OMNIDYN_MOST_BRIDGED) {
        bridged = says;
        says = OMNIDYN_OK;
    }
#endif
    if (says == OMNIDYN_OK && !sane((const float *)path, 6 * (OMNIDYN_HORIZON + 1))) {
        says = OMNIDYN_BAD_PATH;
    }
    if (elapsed < 0.0f) {
        says = OMNIDYN_BACKWARDS;
    }
    if (!sane(&elapsed, 1)) {
        says = OMNIDYN_BAD_TIME;
    }
    if (says == OMNIDYN_OK) {
#if OMNIDYN_ELAPSED
        hold_for(c, known ? elapsed : OMNIDYN_DT);
#endif
        control(c, pose, twist, path, known);
#if OMNIDYN_SWING
        if (bridged == OMNIDYN_OK) {
            swinging = swings(&c->swing, elapsed, pose[2], twist, path[0].velocity);
        }
#endif
        if (!sane(c->x[1], 6)) {
            says = OMNIDYN_FAILED;
        }
    }
    if (says == OMNIDYN_BACKWARDS || says == OMNIDYN_FAILED) { /* what is remembered may be why */
        omnidyn_control_reset(c);
    }
    c->begun |= says != OMNIDYN_BAD_TIME;
    c->known = says == OMNIDYN_OK;
#if LATE_STEPS
    memmove(c->sent[0], c->sent[1], sizeof(c->sent) - sizeof(c->sent[0]));
#endif
    memset(c->sent[LATE_STEPS], 0, sizeof(c->sent[0]));
    if (!c->known) { /* zeros, and why */
        memset(c->sent, 0, sizeof(c->sent));
    }
    ROLLED for (i = 0; i < OMNIDYN_WHEELS; i++) {
        const omnidyn_input *input = &c->input[i];
        float volts = c->known ? within(bounded(input->volts, input), VOLTAGE_LIMIT(i)) : 0.0f;
        if (c->known && input->active) {
            says = OMNIDYN_LIMITED;
        }
#if SLEW
        c->slewed[i] = volts;
#endif
        ROLLED for (j = 0; j < 3; j++) {
            c->sent[LATE_STEPS][j] += PUSH[i][j] * volts;
        }
        volts *= PER_VOLT(i);
        c->last[i] = output[i] = within(volts, OUTPUT_LIMIT(i));
    }
    return c->known && bridged ? bridged : c->known && swinging ? OMNIDYN_SWINGS : says;
}
