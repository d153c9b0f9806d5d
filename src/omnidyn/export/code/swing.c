/* Whether the loop swings: the error of its speed changes its side SWING_CHANGES times within SWING_WINDOW seconds. */
static int swings(omnidyn_swing *s, float elapsed, float heading, const float twist[3], const float velocity[3])
{
    const float c = cosf(heading), d = sinf(heading);
    const float off[3] = {twist[0] - c * velocity[0] - d * velocity[1], twist[1] + d * velocity[0] - c * velocity[1],
                          twist[2] - velocity[2]};
    int i, k, found = 0;
    for (i = 0; i < 3; i++) {
        const float side = off[i] > SWING_LEAST[i] ? 1.0f : off[i] < -SWING_LEAST[i] ? -1.0f : 0.0f;
        const int changed = side != 0.0f && side != s->side[i];
        s->side[i] = changed ? side : s->side[i];
        for (k = 0; k < SWING_CHANGES; k++) {
            s->left[i][k] -= elapsed;
        }
        for (k = 0; changed && k < SWING_CHANGES; k++) {
            s->left[i][k] = k + 1 < SWING_CHANGES ? s->left[i][k + 1] : SWING_WINDOW;
        }
        found |= s->left[i][0] > 0.0f;
    }
    return found;
}
