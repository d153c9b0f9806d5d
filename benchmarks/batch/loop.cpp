// The exact step as a plain loop over robots in blocks, for the compiler to vectorise; and what the machine can at most.
#include <algorithm>
#include <cmath>
#include <cstring>

const int W = 64;

template <class R> static inline R step(R v, R g, R c, R s, R a, R phi) {
  R x = std::fabs(v);
  bool mirrored = (v < 0) | ((v == 0) & (g < 0));
  R q = mirrored ? -g : g;
  R slid = x + phi * (q - c - a * x);
  R back = q < -s ? (q + c) * (phi - (x - phi * a * x) / (c - q)) : R(0);
  R moved = slid >= 0 ? slid : back, released = q <= s ? R(0) : moved;
  moved = x > 0 ? moved : released;
  return mirrored ? -moved : moved;
}

// laws (18 + 3, n): Coulomb, breakaway, rate, phi, acceleration per volt of 3 axes and 3 wheels; volts (steps, 3); v (3, n)
template <class R> static void run(long steps, long n, const R *laws, const R *volts, R *out) {
  R law[21][W], v[3][W];
  for (long b = 0; b < n; b += W) {
    for (int i = 0; i < 21; i++) std::memcpy(law[i], laws + i * n + b, sizeof law[i]);
    std::memset(v, 0, sizeof v);
    for (long k = 0; k < steps; k++) {
      R u0 = volts[3 * k], u1 = volts[3 * k + 1], u2 = volts[3 * k + 2];
      for (int j = 0; j < 3; j++) {
        const R *g = law[12 + 3 * j];
#pragma GCC ivdep
        for (int i = 0; i < W; i++)
          v[j][i] = step<R>(v[j][i], u0 * g[i] + u1 * g[W + i] + u2 * g[2 * W + i], law[j][i], law[3 + j][i],
                            law[6 + j][i], law[9 + j][i]);
      }
    }
    for (int j = 0; j < 3; j++) std::memcpy(out + j * n + b, v[j], sizeof v[j]);
  }
}

extern "C" {
void run64(long steps, long n, const double *laws, const double *volts, double *out) { run(steps, n, laws, volts, out); }
void run32(long steps, long n, const float *laws, const float *volts, float *out) { run(steps, n, laws, volts, out); }

typedef double V __attribute__((vector_size(64)));

// 128 multiply-adds a round, none of which waits for another one of it
double multiply_adds(long rounds) {
  V x[16], m, b;
  for (int q = 0; q < 8; q++) m[q] = 0.999, b[q] = 1e-3;
  for (int i = 0; i < 16; i++) for (int q = 0; q < 8; q++) x[i][q] = i + q;
  for (long k = 0; k < rounds; k++) for (int i = 0; i < 16; i++) x[i] = x[i] * m + b;
  double sum = 0;
  for (int i = 0; i < 16; i++) for (int q = 0; q < 8; q++) sum += x[i][q];
  return sum;
}

// 64 divisions a round
double divisions(long rounds) {
  V x[8], m;
  for (int q = 0; q < 8; q++) m[q] = 1.0001;
  for (int i = 0; i < 8; i++) for (int q = 0; q < 8; q++) x[i][q] = 2 + i + q;
  for (long k = 0; k < rounds; k++) for (int i = 0; i < 8; i++) x[i] = m / x[i];
  double sum = 0;
  for (int i = 0; i < 8; i++) for (int q = 0; q < 8; q++) sum += x[i][q];
  return sum;
}
}
