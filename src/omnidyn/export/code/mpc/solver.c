/* The program of a step: Riccati recursion, active set, interior point where the active set does not settle. The state
   is (pose, twist, 1), the cost to go a matrix of 7 x 7; inputs are taken out of it one at a time. The equations:
   omnidyn/control/mpc/riccati.py, active_set.py, interior_point.py. */

#define INPUTS (OMNIDYN_HORIZON * OMNIDYN_WHEELS)

#if BOUNDED
#define BOUND(side, input) ((input)->bound[side])
#else
static const float BOUNDS[2] = {-VOLTAGE_LIMIT(0), VOLTAGE_LIMIT(0)};
#define BOUND(side, input) ((void)(input), BOUNDS[side])
#endif

/* From the last step to the first: how the slope of the cost by the drive follows from the state. */
static void backward(omnidyn_control *c)
{
    float s[7][7], m[10][7], f[10][10], t[10], last = LAST_WEIGHT;
    int k, i, j, q;
    memset(s, 0, sizeof(s));
    memset(m, 0, sizeof(m));
    m[0][0] = m[1][1] = m[6][6] = 1.0f;
    for (k = OMNIDYN_HORIZON - 1; k >= 0; k--) {
        ROLLED for (i = 0; i < 6; i++) {
            float weight = WEIGHT[i] * last, pull = weight * c->goal[k + 1][i];
            s[i][i] += weight;
            s[i][6] -= pull;
            s[6][i] -= pull;
        }
        last = 1.0f;
        for (j = 0; j < 8; j++) {
            memcpy(m[2 + j], c->columns[k][j], sizeof(c->columns[k][j]));
        }
        ROLLED for (j = 0; j < 10; j++) { /* f = m s m^T: of pose, twist, 1 and drive */
            ROLLED for (i = 0; i < 7; i++) {
                t[i] = dot(s[i], m[j], 7);
            }
            ROLLED for (i = 0; i < 10; i++) {
                f[j][i] = dot(m[i], t, 7);
            }
        }
        ROLLED for (q = 0; q < OMNIDYN_WHEELS; q++) {
            const omnidyn_input *input = &c->input[OMNIDYN_WHEELS * k + q];
            const float *drive = PUSH[q];
            float share;
            ROLLED for (i = 0; i < 10; i++) {
                t[i] = dot3(f[i] + 7, drive);
            }
            ROLLED for (i = 0; i < 10; i++) { /* to be at its aim, if it were free to be there */
                f[i][6] += input->hold[1] * t[i];
                f[6][i] += input->hold[1] * t[i];
            }
            t[6] = dot3(f[6] + 7, drive);
            share = input->hold[0] / (1.0f + input->hold[0] * dot3(t + 7, drive));
            ROLLED for (i = 0; i < 10; i++) {
                ROLLED for (j = 0; j < 10; j++) {
                    f[i][j] -= share * t[i] * t[j];
                }
            }
        }
        ROLLED for (i = 0; i < 10; i++) {
            memcpy(i < 7 ? s[i] : c->gain[k][i - 7], f[i], sizeof(s[i]));
        }
    }
}

/* From the first step to the last: inputs, and states into x. With `correct` inputs beyond a bound are held there, and
   those that a bound no longer pushes let go; returns whether any was. Without, the inputs are those of `next`. */
static int forward(omnidyn_control *c, int correct)
{
    omnidyn_input *input = c->input;
    int k, i, j, changed = 0;
    for (k = 0; k < OMNIDYN_HORIZON; k++) {
        float g[3], drive[3] = {0.0f};
        ROLLED for (i = 0; i < 3; i++) {
            g[i] = c->gain[k][i][6] + dot(c->gain[k][i], c->x[k], 6);
        }
        for (i = 0; i < OMNIDYN_WHEELS; i++, input++) {
            const float along = dot3(PUSH[i], g), volts = input->hold[1] - input->hold[0] * along;
            const int side = input->active;
            ROLLED for (j = 0; j < 3; j++) {
                drive[j] += PUSH[i][j] * volts;
            }
            input->next = volts;
            if (correct) {
                input->volts = volts;
                input->next = volts - input->wanted + along / VOLTS_WEIGHT; /* slope of the cost, over its weight */
                if (side == 0) {
                    input->active = (volts > BOUND(1, input) + BEYOND) - (volts < BOUND(0, input) - BEYOND);
                } else if ((float)side * input->next > BEYOND) {
                    input->active = 0;
                }
                changed |= side != input->active;
            }
        }
        advance(c->columns[k], c->x[k], drive, c->x[k + 1]);
    }
    return changed;
}

/* Solve from the guess in `active`; whether that settled. */
static int active_set(omnidyn_control *c, int most)
{
    omnidyn_input *input;
    do {
        for (input = c->input; input < c->input + INPUTS; input++) {
            const int side = input->active;
            input->hold[0] = side ? 0.0f : 1.0f / VOLTS_WEIGHT;
            input->hold[1] = side == 0 ? input->wanted : BOUND(side > 0, input);
        }
        backward(c);
        if (!forward(c, 1)) {
            return 1;
        }
    } while (--most > 0);
    return 0;
}

/* How near an input is to a bound [1/V], with the sign of that side; a float cannot tell more than LEAST apart. */
static float nearness(const omnidyn_input *input, unsigned side)
{
    const float gap = fabsf(BOUND(side, input) - input->volts);
    return (side ? 1.0f : -1.0f) / (gap > LEAST ? gap : LEAST);
}

/* The same program by an interior point method: inputs into `volts`, and the bounds they meet into `active`. */
static void interior_point(omnidyn_control *c)
{
    omnidyn_input *input;
    float along = 0.0f;
    unsigned j;
    int pass;
    for (input = c->input; input < c->input + INPUTS; input++) {
        along += fabsf(input->next);
        input->volts = 0.5f * (BOUND(0, input) + BOUND(1, input));
    }
    for (input = c->input; input < c->input + INPUTS; input++) { /* as large as the slopes are that they must balance */
        input->push[0] = input->push[1] = VOLTS_WEIGHT / INPUTS * along;
    }
    along = 0.0f;
    for (pass = 0; pass < MOST; pass++) {
        float mu = 0.0f;
        for (j = 0, input = c->input; j < 2 * INPUTS; input += j++ % 2) { /* the step that the pass before has found; j counts both bounds of each input */
            float *push = &input->push[j % 2];
            if (j % 2 == 0) {
                input->volts += along * (input->next - input->volts);
            }
            *push += along * input->hold[j % 2];
            mu += *push * fabsf(BOUND(j % 2, input) - input->volts);
        }
        mu *= CENTRE / (2 * INPUTS);
        if (!(mu > TIGHT)) {
            break;
        }
        for (j = 0, input = c->input; j < 2 * INPUTS; input += j++ % 2) {
            const float r = nearness(input, j % 2);
            const float stiff = fabsf(r) * input->push[j % 2];
            if (j % 2 == 0) {
                input->hold[0] = VOLTS_WEIGHT;
                input->hold[1] = VOLTS_WEIGHT * input->wanted;
            }
            input->hold[0] += stiff;
            input->hold[1] += stiff * input->volts - mu * r;
            if (j % 2) {
                input->hold[0] = 1.0f / input->hold[0];
                input->hold[1] *= input->hold[0];
            }
        }
        backward(c);
        forward(c, 0);
        along = 1.0f / BACK_OFF; /* as far as the first of all that must not come down to 0 */
        for (j = 0, input = c->input; j < 2 * INPUTS; input += j++ % 2) {
            const float r = nearness(input, j % 2), push = input->push[j % 2];
            const float nearer = r * (input->next - input->volts), change = mu * fabsf(r) - push + push * nearer;
            input->hold[j % 2] = change;
            along = nearer * along > 1.0f ? 1.0f / nearer : along;
            along = -change * along > push ? -push / change : along;
        }
        along *= BACK_OFF;
        along = along < 1.0f ? along : 1.0f;
    }
    for (input = c->input; input < c->input + INPUTS; input++) { /* at a bound that pushes more than it is away, each in its scale */
        const float off = SHARP * input->volts;
        input->active = (input->push[1] > SHARP * BOUND(1, input) - off) -
                        (input->push[0] > off - SHARP * BOUND(0, input));
    }
}

/* The optimum from the guess in `active`. */
static void solve(omnidyn_control *c)
{
    if (!active_set(c, FIRST_PASSES)) {
        float inside[OMNIDYN_WHEELS];
        int i;
        interior_point(c);
        ROLLED for (i = 0; i < OMNIDYN_WHEELS; i++) {
            inside[i] = c->input[i].volts;
        }
        if (!active_set(c, LAST_PASSES)) { /* what the interior point method found is near enough */
            ROLLED for (i = 0; i < OMNIDYN_WHEELS; i++) {
                c->input[i].volts = inside[i];
            }
        }
    }
}
