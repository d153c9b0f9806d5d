/* Where the robot is now, from a pose that is LATE_AGE [s] old when it arrives, and its speeds since: those of the last
   steps are kept as places, seen from where the robot is now. The equations: omnidyn/control/late_pose.py. */

/* A place seen from a body that has moved on by (dx, dy), then turned by `turn`. */
static void seen_after(float place[3], float dx, float dy, float turn)
{
    const float x = place[0] - dx, y = place[1] - dy, cosine = cosf(turn), sine = sinf(turn);
    place[0] = cosine * x + sine * y;
    place[1] = cosine * y - sine * x;
    place[2] -= turn;
}

/* Writes the pose as of now into `now`. */
static void pose_now(omnidyn_late *late, float elapsed, const float pose[3], const float twist[3], float now[3])
{
    const float passed = late->count ? late->waited + elapsed : 0.0f;
    float mean[3], dx, dy, turn, cosine, sine, *then = late->then;
    int i, k;
    for (i = 0; i < 3; i++) {
        mean[i] = passed * (LATE_MEAN ? twist[i] : 0.5f * (twist[i] + late->twist[i]));
        late->twist[i] = twist[i];
    }
    late->waited = 0.0f;
    turn = mean[2];
    cosine = cosf(0.5f * turn);
    sine = sinf(0.5f * turn);
    dx = cosine * mean[0] - sine * mean[1];
    dy = sine * mean[0] + cosine * mean[1];
    for (k = 0; k < late->count; k++) { /* row 0 is the oldest */
        late->age[k] += passed;
        seen_after(late->place[k], dx, dy, turn);
    }
    seen_after(then, dx, dy, turn);
    while (late->count == LATE_ROWS || (late->count > 1 && late->age[1] >= LATE_AGE)) {
        late->count--;
        memmove(late->age, late->age + 1, (LATE_ROWS - 1) * sizeof(late->age[0]));
        memmove(late->place, late->place + 1, (LATE_ROWS - 1) * sizeof(late->place[0]));
    }
    late->age[late->count] = 0.0f;
    memset(late->place[late->count], 0, sizeof(late->place[0]));
    late->count++;
    if (!late->known || pose[0] != late->seen[0] || pose[1] != late->seen[1] || pose[2] != late->seen[2]) {
        const float *after = late->place[late->count > 1], *before = late->place[0];
        const float between = late->count > 1 ? late->age[0] - late->age[1] : 0.0f;
        float share = between > 0.0f ? (late->age[0] - LATE_AGE) / between : 0.0f;
        share = share > 0.0f ? share : 0.0f; /* at first the oldest there is */
        for (i = 0; i < 3; i++) {
            then[i] = before[i] + share * (after[i] - before[i]);
            late->seen[i] = pose[i];
        }
        late->known = 1;
    }
    turn = pose[2] - then[2];
    cosine = cosf(turn);
    sine = sinf(turn);
    now[0] = pose[0] - (cosine * then[0] - sine * then[1]);
    now[1] = pose[1] - (sine * then[0] + cosine * then[1]);
    now[2] = turn;
}
