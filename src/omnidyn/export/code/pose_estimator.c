/* Where the robot is now, from poses that are LATE_AGE [s] old when they arrive, and its speeds since: those of the last
   steps are kept as places, seen from where the robot is now. The equations: omnidyn/control/pose_estimator.py. */

/* A place seen from a body that has moved on by (dx, dy), then turned by `turn`. */
static void seen_after(float place[3], float dx, float dy, float turn)
{
    const float x = place[0] - dx, y = place[1] - dy, cosine = cosf(turn), sine = sinf(turn);
    place[0] = cosine * x + sine * y;
    place[1] = cosine * y - sine * x;
    place[2] -= turn;
}

/* Add a step to what was counted: places of the steps before, as seen from where the robot is now. */
static void count_on(omnidyn_late *late, float passed, const float twist[3])
{
    float mean[3], dx, dy, turn, cosine, sine, distance;
    int i, k;
    for (i = 0; i < 3; i++) {
        mean[i] = passed * (LATE_MEAN ? twist[i] : 0.5f * (twist[i] + late->twist[i]));
        late->twist[i] = twist[i];
    }
    turn = mean[2];
    cosine = cosf(0.5f * turn);
    sine = sinf(0.5f * turn);
    dx = cosine * mean[0] - sine * mean[1];
    dy = sine * mean[0] + cosine * mean[1];
    for (k = 0; k < late->count; k++) { /* row 0 is the oldest */
        late->age[k] += passed;
        seen_after(late->place[k], dx, dy, turn);
    }
    seen_after(late->then, dx, dy, turn);
    distance = sqrtf(mean[0] * mean[0] + mean[1] * mean[1]);
    late->drift[0] += LATE_BY_DISTANCE * distance + LATE_BY_TIME * passed;
    late->drift[1] += LATE_BY_TURN * fabsf(turn) + LATE_TURN_BY_DISTANCE * distance + LATE_TURN_BY_TIME * passed;
    while (late->count == LATE_ROWS || (late->count > 1 && late->age[1] >= LATE_AGE)) {
        late->count--;
        memmove(late->age, late->age + 1, (LATE_ROWS - 1) * sizeof(late->age[0]));
        memmove(late->place, late->place + 1, (LATE_ROWS - 1) * sizeof(late->place[0]));
    }
    late->age[late->count] = 0.0f;
    memset(late->place[late->count], 0, sizeof(late->place[0]));
    late->count++;
}

/* The gain of a new pose off by so much; 1 believes it at once. */
static float gain_of(float *variance, float drift, float noise, float off_square, float dimensions)
{
    float gain;
    *variance += powf(2.0f * drift, 4.0f / 3.0f) * powf(noise, 1.0f / 3.0f);
    if (noise == 0.0f || !(off_square <= dimensions * LATE_OUTLIER * (*variance + noise))) {
        *variance = noise;
        return 1.0f;
    }
    gain = *variance / (*variance + noise);
    *variance = gain * noise;
    return gain;
}

/* Believe a new pose as far as its noise allows. */
static void correct(omnidyn_late *late, const float pose[3], const float twist[3])
{
    const float *after = late->place[late->count > 1], *before = late->place[0], *anchor = late->anchor;
    const float between = late->count > 1 ? late->age[0] - late->age[1] : 0.0f;
    const float wait = LATE_WAIT * LATE_WAIT;
    float share = between > 0.0f ? (late->age[0] - LATE_AGE) / between : 0.0f, then[3], past[3], off[3], gain, turn;
    int i;
    share = share > 0.0f ? share : 0.0f; /* at first the oldest there is */
    for (i = 0; i < 3; i++) {
        then[i] = before[i] + share * (after[i] - before[i]);
        past[i] = pose[i];
    }
    if (late->known > 1) { /* from the anchor to now, and back to then */
        const float heading = anchor[2] - late->then[2], dx = then[0] - late->then[0], dy = then[1] - late->then[1];
        const float cosine = cosf(heading), sine = sinf(heading);
        past[0] = anchor[0] + cosine * dx - sine * dy;
        past[1] = anchor[1] + sine * dx + cosine * dy;
        past[2] = heading + then[2];
    } else {
        late->variance[0] = LATE_NOISE * LATE_NOISE;
        late->variance[1] = LATE_TURN_NOISE * LATE_TURN_NOISE;
    }
    for (i = 0; i < 3; i++) {
        off[i] = pose[i] - past[i];
    }
    off[2] = remainderf(off[2], LATE_FULL_TURN);
    gain = gain_of(&late->variance[0], late->drift[0],
                   LATE_NOISE * LATE_NOISE + wait * (twist[0] * twist[0] + twist[1] * twist[1]),
                   off[0] * off[0] + off[1] * off[1], 2.0f);
    turn = gain_of(&late->variance[1], late->drift[1],
                   LATE_TURN_NOISE * LATE_TURN_NOISE + wait * twist[2] * twist[2], off[2] * off[2], 1.0f);
    late->anchor[0] = past[0] + gain * off[0];
    late->anchor[1] = past[1] + gain * off[1];
    late->anchor[2] = past[2] + turn * off[2];
    for (i = 0; i < 3; i++) {
        late->then[i] = then[i];
        late->seen[i] = pose[i];
    }
    late->drift[0] = late->drift[1] = 0.0f;
    late->known = 1 + (late->age[0] >= LATE_ALL_OF_IT * LATE_AGE); /* whether all since then was counted */
}

#if LATE_UNSURE
/* Find out whether poses are counted by the same wheels, and so new: from rest they then move at once. */
static void tell_kind(omnidyn_late *late, float passed, const float pose[3], const float twist[3])
{
    float mean[3], cosine, sine, off[3], way;
    int i, alike;
    for (i = 0; i < 3; i++) {
        mean[i] = passed * (LATE_MEAN ? twist[i] : 0.5f * (twist[i] + late->twist[i]));
        off[i] = pose[i] - late->last[i];
    }
    cosine = cosf(late->last[2] + 0.5f * mean[2]);
    sine = sinf(late->last[2] + 0.5f * mean[2]);
    off[0] -= cosine * mean[0] - sine * mean[1];
    off[1] -= sine * mean[0] + cosine * mean[1];
    off[2] = remainderf(off[2] - mean[2], LATE_FULL_TURN);
    way = sqrtf(mean[0] * mean[0] + mean[1] * mean[1]);
    if (way + fabsf(mean[2]) > LATE_TINY) {
        alike = sqrtf(off[0] * off[0] + off[1] * off[1]) <= LATE_ALIKE * way + LATE_TINY &&
                fabsf(off[2]) <= LATE_ALIKE * fabsf(mean[2]) + LATE_TINY;
        late->kind = alike && late->kind != 2 ? 1 : 2; /* 1: counted, 2: late */
    }
}
#endif

/* Writes the pose as of now into `now`. */
static void pose_now(omnidyn_late *late, float elapsed, const float pose[3], const float twist[3], float now[3])
{
    const float *then = late->then, passed = late->count ? late->waited + elapsed : 0.0f;
    float cosine, sine;
#if LATE_UNSURE
    if (passed > 0.0f && passed < LATE_LONGEST) {
        tell_kind(late, passed, pose, twist);
    }
    memcpy(late->last, pose, sizeof(late->last));
#endif
    count_on(late, passed, twist);
    late->waited = 0.0f;
    if (!late->known || pose[0] != late->seen[0] || pose[1] != late->seen[1] || pose[2] != late->seen[2]) {
        correct(late, pose, twist);
    }
#if LATE_UNSURE
    if (late->kind == 1) {
        memcpy(now, pose, sizeof(late->last));
        return;
    }
#endif
    now[2] = late->anchor[2] - then[2];
    cosine = cosf(now[2]);
    sine = sinf(now[2]);
    now[0] = late->anchor[0] - cosine * then[0] + sine * then[1];
    now[1] = late->anchor[1] - sine * then[0] - cosine * then[1];
}
