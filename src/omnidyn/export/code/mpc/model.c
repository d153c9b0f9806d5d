/* What an input does to the robot within a step, made linear along a predicted motion: columns[j] is what heading, twist
   (3), 1 and drive (3) give pose (3) and twist (3); x and y but add to what they are. The equations: omnidyn/control/mpc/stages.py. */

#define TURN 6.28318530718f

#if defined(__OPTIMIZE_SIZE__) && defined(__GNUC__) && !defined(__clang__) && __GNUC__ >= 8
#define ROLLED _Pragma("GCC unroll 1") /* what is to be small does not unroll its loops */
#else
#define ROLLED
#endif

#if OMNIDYN_ELAPSED /* the gains and the length of the step that is looked at */
#define HELD c->held
#define STEP c->step
#else
#define HELD GAINS
#define STEP OMNIDYN_DT
#endif
#define PHI(i) HELD[3 + (i)] /* rows of DECAY, PHI, PSI are those of the gains */

static float within(float value, float most)
{
    value = value < most ? value : most;
    return value > -most ? value : -most;
}

static float dot(const float *a, const float *b, int n)
{
    float sum = 0.0f;
    while (n-- > 0) {
        sum += a[n] * b[n];
    }
    return sum;
}

/* x and y of a vector in the world as the body sees them. */
static void seen(float heading, float x, float y, float *found)
{
    const float cosine = cosf(heading), sine = sinf(heading);
    found[0] = cosine * x + sine * y;
    found[1] = cosine * y - sine * x;
}

static float dot3(const float *a, const float *b)
{
    return dot(a, b, 3);
}

#if OMNIDYN_ELAPSED
/* Add a product, times a number, to a matrix. */
static void add_product(float by, float a[3][3], float b[3][3], float sum[3][3])
{
    int i, j, k;
    ROLLED for (i = 0; i < 3; i++) {
        ROLLED for (j = 0; j < 3; j++) {
            ROLLED for (k = 0; k < 3; k++) {
                sum[i][j] += by * a[i][k] * b[k][j];
            }
        }
    }
}

/* What is summed up becomes `by` times the rates times itself, and `one` on the diagonal; next is room. */
static void next_term(float by, float rates[3][3], float sum[3][3], float one, float next[3][3])
{
    int i;
    memset(next, 0, 9 * sizeof(float));
    ROLLED for (i = 0; i < 3; i++) {
        next[i][i] = one;
    }
    add_product(by, rates, sum, next);
    memcpy(sum, next, 9 * sizeof(float));
}

/* The gains for a step of another length: with d what it is longer, e^(A d) = I + A PHI_d by its series, once = PHI_d/d
   and twice = PSI_d/d^2. */
static void hold_for(omnidyn_control *c, float step)
{
    const float d = step - OMNIDYN_DT;
    float(*room)[3][3] = (float(*)[3][3])c->columns; /* the program of this step is yet to come */
    float(*decay)[3] = room[0], (*rates)[3] = room[1], (*once)[3] = room[2], (*twice)[3] = room[3], (*next)[3] = room[4];
    int i, k;
    c->step = step;
    memcpy(c->held, GAINS, sizeof(c->held));
    if (fabsf(d) <= SAME_STEP * OMNIDYN_DT) {
        return;
    }
    memset(room, 0, 4 * sizeof(*room));
    memcpy(decay, GAINS, sizeof(*room));
    memcpy(next, FEED, sizeof(*room));
    ROLLED for (i = 0; i < 3; i++) {
        decay[i][i] -= 1.0f;
    }
    add_product(1.0f, decay, next, rates);
    memcpy(decay, GAINS, sizeof(*room));
    for (k = TERMS; k > 0; k--) {
        next_term(d / (float)(k + 1), rates, once, 1.0f, next);
        next_term(d / (float)(k + 2), rates, twice, 0.5f, next);
    }
    memset(next, 0, sizeof(*room));
    add_product(d, rates, once, next);
    add_product(1.0f, decay, next, c->held);
    add_product(d, decay, once, c->held + 3);
    add_product(d * d, decay, twice, c->held + 6);
    ROLLED for (i = 0; i < 9; i++) {
        c->held[6 + i / 3][i % 3] += d * GAINS[3 + i / 3][i % 3];
    }
    memset(room, 0, 5 * sizeof(*room)); /* entries of `columns` that stay 0 are not written */
}
#endif

/* How friction is taken: falling to 0 below a small speed; with the wider slope that the program needs; as good as not
   falling at all. */
enum { PLAIN, SOFT, STICKING };

/* Deceleration by dry friction at a twist, f[0], and what an entry of the twist adds to it, f[1] to f[3]. */
static void friction_at(const float *twist, int how, float f[4][3])
{
#if LEVELS || ELLIPSE
    const float narrow = how == STICKING ? EXACT : 1.0f;
    int i, j;
#endif
#if LEVELS
    int e;
#endif
    (void)twist, (void)how;
    memset(f, 0, 12 * sizeof(float));
#if LEVELS
    for (e = 0; e < LEVELS; e++) {
        const float *own = LEVEL[e], speed = dot3(own, twist), width = narrow * own[8];
        const float level = speed >= 0.0f ? own[6] : own[7], near = how == SOFT ? own[9] : width;
        float steep = 1.0f - fabsf(speed) / near;
        steep = steep > 0.0f ? how == SOFT ? 2.0f * steep * level / near : level / near : 0.0f;
        ROLLED for (i = 0; i < 3; i++) {
            f[0][i] += own[3 + i] * level * within(speed / width, 1.0f);
            ROLLED for (j = 0; j < 3; j++) {
                f[1 + j][i] += own[3 + i] * own[j] * steep;
            }
        }
    }
#endif
#if ELLIPSE
    {
        const float x = ELLIPSE_X * twist[0], y = ELLIPSE_Y * twist[1], width = narrow * ELLIPSE_WIDTH;
        const float size = sqrtf(x * twist[0] + y * twist[1]), r = 1.0f / (size > width ? size : width);
        const float bend = size > width ? r : 0.0f, p = x * r, q = y * r;
        const float own[3][2] = {{p, q},
                                 {ELLIPSE_X * r - p * p * bend, -p * q * bend},
                                 {-p * q * bend, ELLIPSE_Y * r - q * q * bend}};
        for (i = 0; i < 3; i++) {
            for (j = 0; j < 3; j++) {
                f[j][i] += BY_MASS[i][0] * own[j][0] + BY_MASS[i][1] * own[j][1];
            }
        }
    }
#endif
}

#if TURNING
/* Terms of a turning frame. */
static void frame_at(const float *twist, float n[3])
{
    const float across[3] = {twist[2] * twist[1], -twist[2] * twist[0], OFF_CENTRE ? twist[2] * twist[2] : 0.0f};
    int i;
    ROLLED for (i = 0; i < 3; i++) {
        n[i] = dot3(FRAME[i], across);
    }
}
#endif

/* A step from x that ends with a twist; friction is that of the twist `sense`. Entries of `columns` that stay 0 are not
   written. */
static void linear_stage(const omnidyn_control *c, const float *x, const float *end, const float *sense, int how,
                         float columns[8][6])
{
    const float *twist = x + 3;
    float f[4][3], both[6][10], angle, cosine, sine, *turn = columns[0];
    int i, j, p;
    friction_at(sense, how, f);
    ROLLED for (i = 0; i < 3; i++) {
        ROLLED for (j = 0; j < 4; j++) {
            f[j][i] *= c->believed[3][i];
        }
        f[0][i] = c->believed[2][i] - f[0][i];
    }
    /* both: of twist and displacement, what K stands for (3), then twist, constant, drive. */
    ROLLED for (i = 0; i < 6; i++) {
        const float *gain = HELD[3 + i];
        float *row = both[i];
        ROLLED for (j = 0; j < 3; j++) {
            row[j] = dot3(gain, f[1 + j]);
            row[3 + j] = HELD[i][j];
            row[7 + j] = gain[j];
        }
        row[6] = dot3(gain, f[0]) + dot3(row, end);
    }
#if TURNING
    {
        const float w[3] = {0.5f * (twist[0] + end[0]), 0.5f * (twist[1] + end[1]), 0.5f * (twist[2] + end[2])};
        const float by[3][3] = {{0.0f, w[2], w[1]}, {-w[2], 0.0f, -w[0]}, {0.0f, 0.0f, 2.0f * w[2]}};
        float n[3], bend[3];
        frame_at(w, n);
        ROLLED for (i = 0; i < 3; i++) { /* n - J w = -n, as n is of second order */
            n[i] = -n[i];
        }
        ROLLED for (i = 0; i < 6; i++) {
            const float *gain = HELD[3 + i];
            both[i][6] += dot3(gain, n);
            ROLLED for (j = 0; j < 3; j++) {
                ROLLED for (p = 0; p < 3; p++) {
                    bend[p] = 0.5f * (FRAME[p][0] * by[0][j] + FRAME[p][1] * by[1][j]
                                      + (OFF_CENTRE ? FRAME[p][2] * by[2][j] : 0.0f));
                }
                both[i][j] -= dot3(gain, bend);
                both[i][3 + j] += dot3(gain, bend);
            }
        }
    }
#endif
    ROLLED for (i = 0; i < 3; i++) {
        both[i][i] += 1.0f;
    }
    ROLLED for (p = 0; p < 3; p++) { /* (1 + Phi G) twist+ = ..., and what that takes from the displacement */
        for (j = 9; j >= p; j--) {
            both[p][j] /= both[p][p];
        }
        ROLLED for (i = 0; i < 6; i++) {
            const float share = i == p ? 0.0f : both[i][p];
            for (j = p; j < 10; j++) {
                both[i][j] -= share * both[p][j];
            }
        }
    }
    angle = (twist[2] + end[2]) * (0.25f * STEP);
    sine = 1.0f - angle * angle / 6.0f; /* a chord is shorter than its arc */
    angle += x[2];
    cosine = sine * cosf(c->base[2] + angle);
    sine *= sinf(c->base[2] + angle);
    f[0][0] = (twist[0] + end[0]) * (0.5f * STEP);
    f[0][1] = (twist[1] + end[1]) * (0.5f * STEP);
    turn[0] = -sine * f[0][0] - cosine * f[0][1];
    turn[1] = cosine * f[0][0] - sine * f[0][1];
    turn[2] = 1.0f;
    ROLLED for (j = 1; j < 8; j++) {
        const float dx = both[3][2 + j], dy = both[4][2 + j], z = both[5][2 + j];
        const float about = 0.5f * z - (j == 4 ? angle : 0.0f);
        float *column = columns[j];
        column[0] = cosine * dx - sine * dy + turn[0] * about;
        column[1] = sine * dx + cosine * dy + turn[1] * about;
        column[2] = z;
        ROLLED for (i = 0; i < 3; i++) {
            column[3 + i] = both[i][2 + j];
        }
    }
}

/* The state x a step on under a drive; may be written into its own place. */
static void advance(float columns[8][6], const float *x, const float *drive, float *after)
{
    float one[8];
    int i, j;
    memcpy(one, x + 2, 4 * sizeof(float));
    one[4] = 1.0f;
    memcpy(one + 5, drive, 3 * sizeof(float));
    ROLLED for (i = 0; i < 6; i++) {
        float end = i < 2 ? x[i] : 0.0f;
        ROLLED for (j = 0; j < 8; j++) {
            end += columns[j][i] * one[j];
        }
        after[i] = end;
    }
}

/* The state x a step on under a drive, by the model with what was learned; stage 0 is room for it. */
static void run_on(omnidyn_control *c, float *x, const float *drive)
{
    float after[6] = {0.0f};
    int pass;
    for (pass = 0; pass < PASSES; pass++) {
        linear_stage(c, x, after + 3, after + 3, STICKING, c->columns[0]);
        advance(c->columns[0], x, drive, after);
    }
    memcpy(x, after, sizeof(after));
}
