// Explicit finite elements: forces of neo-Hookean tetrahedra with fibres and viscosity, the ground's layer, friction.
// Sixteen tetrahedra are the lanes of a vector, in single precision; places and velocities of nodes are in double. SI units.
//
// A step is symplectic Euler. Velocities under viscosity, which alone would need steps thirty times smaller, and the other
// forces, constant in a step, are found by stages of a Runge-Kutta-Legendre method (RKL1, Meyer et al. 2014).
#include <algorithm>
#include <cmath>
#include <cstring>

typedef float vec __attribute__((vector_size(64)));
static const int LANES = 16;
static const float SMALLEST_J = 0.05f;  // below it log J is held, as in zoobench

struct Body {
    int blocks, node_count, pieces, stages;
    const int *cells;                                // [blocks][NN][16]
    const float *slopes;                             // [NQ][NN][3] of the shape functions in the reference tetrahedron
    const float *inverse, *volume, *mu, *lam, *fibre, *tension;  // [blocks][NQ]([9] or [3])[16]
    float *pulled;                                   // [blocks][NQ][9][16], see `elastic`
    const int *piece;                                // [pieces][4] nodes of linear tetrahedra that feel the ground
    const double *piece_volume, *mass, *weight;
    double *x, *v, *force, *push, *stage, *way;      // stage: [2][nodes][3]; way: [nodes][2], where a node slides to
    int *held;                                       // [nodes] 1 where friction holds, 2 where it does not suffice
    double eta, friction, slope, thickness, rate;  // slope: of the ground, by turning the weight [rad]
};

template <int NN> static inline void reference(const float *slopes, const vec X[NN][3], vec A[3][3]) {
    for (int i = 0; i < 3; i++) for (int c = 0; c < 3; c++) A[i][c] = vec{};
    for (int a = 0; a < NN; a++) for (int i = 0; i < 3; i++) for (int c = 0; c < 3; c++) A[i][c] += X[a][i] * slopes[3 * a + c];
}

static inline void times(const vec A[3][3], const vec *G, vec out[3][3]) {
    for (int i = 0; i < 3; i++) for (int c = 0; c < 3; c++) out[i][c] = A[i][0] * G[c] + A[i][1] * G[3 + c] + A[i][2] * G[6 + c];
}

template <int NN> static inline void spread(const vec P[3][3], const vec *G, const float *slopes, vec out[NN][3]) {
    vec Q[3][3];
    for (int r = 0; r < 3; r++) for (int c = 0; c < 3; c++) Q[r][c] = P[r][0] * G[3 * c] + P[r][1] * G[3 * c + 1] + P[r][2] * G[3 * c + 2];
    for (int a = 0; a < NN; a++) for (int r = 0; r < 3; r++) for (int c = 0; c < 3; c++) out[a][r] += Q[r][c] * slopes[3 * a + c];
}

static inline vec inverse_transposed(const vec F[3][3], vec H[3][3]) {
    for (int r = 0; r < 3; r++) for (int c = 0; c < 3; c++) {
        int r1 = (r + 1) % 3, r2 = (r + 2) % 3, c1 = (c + 1) % 3, c2 = (c + 2) % 3;
        H[r][c] = F[r1][c1] * F[r2][c2] - F[r1][c2] * F[r2][c1];
    }
    vec J = F[0][0] * H[0][0] + F[0][1] * H[0][1] + F[0][2] * H[0][2], least = vec{} + SMALLEST_J;
    vec held = J > SMALLEST_J ? J : least;
    for (int r = 0; r < 3; r++) for (int c = 0; c < 3; c++) H[r][c] /= held;
    return J;
}

// Relative to the first node of each tetrahedron, so that single precision suffices.
template <int NN> static inline void gather(const int *cells, const double *from, vec X[NN][3]) {
    for (int l = 0; l < LANES; l++) {
        const double *origin = from + 3 * cells[l];
        for (int a = 0; a < NN; a++) for (int i = 0; i < 3; i++) X[a][i][l] = float(from[3 * cells[a * LANES + l] + i] - origin[i]);
    }
}

template <int NN> static inline void scatter(const int *cells, const vec out[NN][3], double *into) {
    for (int a = 0; a < NN; a++) for (int l = 0; l < LANES; l++) for (int i = 0; i < 3; i++) into[3 * cells[a * LANES + l] + i] += out[a][i][l];
}

// Forces but for viscosity; keeps J0^-1 F^-1 of every point, by which rates in the reference element become spatial.
template <int NN, int NQ> static void elastic(const Body &b) {
    for (int n = 0; n < b.blocks; n++) {
        const int *cells = b.cells + size_t(n) * NN * LANES;
        vec X[NN][3], out[NN][3] = {}; gather<NN>(cells, b.x, X);
        for (int q = 0; q < NQ; q++) {
            const size_t k = (size_t(n) * NQ + q) * LANES;
            vec A[3][3], F[3][3], H[3][3], P[3][3];
            const vec *G = (const vec *)(b.inverse + k * 9), *d = (const vec *)(b.fibre + k * 3); vec *K = (vec *)(b.pulled + k * 9);
            reference<NN>(b.slopes + q * NN * 3, X, A); times(A, G, F);
            const vec J = inverse_transposed(F, H), w = *(const vec *)(b.volume + k), mu = *(const vec *)(b.mu + k);
            const vec lam = *(const vec *)(b.lam + k), T = *(const vec *)(b.tension + k);
            vec log_j; for (int l = 0; l < LANES; l++) log_j[l] = std::log(std::max(J[l], SMALLEST_J));
            for (int r = 0; r < 3; r++) for (int c = 0; c < 3; c++) K[3 * r + c] = G[3 * r] * H[c][0] + G[3 * r + 1] * H[c][1] + G[3 * r + 2] * H[c][2];
            // P = mu F + (lambda log J - mu) F^-T + T (F d) d^T
            for (int r = 0; r < 3; r++) {
                const vec stretched = T * (F[r][0] * d[0] + F[r][1] * d[1] + F[r][2] * d[2]);
                for (int c = 0; c < 3; c++) P[r][c] = -w * (mu * F[r][c] + (lam * log_j - mu) * H[r][c] + stretched * d[c]);
            }
            spread<NN>(P, G, b.slopes + q * NN * 3, out);
        }
        scatter<NN>(cells, out, b.force);
    }
}

// Forces of the Kirchhoff stress 2 eta D at velocities v, with what `elastic` kept.
template <int NN, int NQ> static void viscous(const Body &b, const double *v, double *force) {
    const float eta = float(b.eta);
    for (int n = 0; n < b.blocks; n++) {
        const int *cells = b.cells + size_t(n) * NN * LANES;
        vec V[NN][3], out[NN][3] = {}; gather<NN>(cells, v, V);
        for (int q = 0; q < NQ; q++) {
            const size_t k = (size_t(n) * NQ + q) * LANES;
            vec A[3][3], L[3][3], S[3][3]; const vec *K = (const vec *)(b.pulled + k * 9), w = *(const vec *)(b.volume + k);
            reference<NN>(b.slopes + q * NN * 3, V, A); times(A, K, L);
            for (int r = 0; r < 3; r++) for (int c = 0; c < 3; c++) S[r][c] = -eta * w * (L[r][c] + L[c][r]);
            spread<NN>(S, K, b.slopes + q * NN * 3, out);
        }
        scatter<NN>(cells, out, force);
    }
}

// Adds the integral of g times every barycentric coordinate over the part with these corners, for g linear between them.
static void part(const double corner[4][4], const double g[4], double volume, double sign, double out[4]) {
    double m[3][3]; for (int k = 0; k < 3; k++) for (int c = 0; c < 3; c++) m[k][c] = corner[k + 1][c + 1] - corner[0][c + 1];
    const double size = std::fabs(m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]));
    const double sum = g[0] + g[1] + g[2] + g[3];
    for (int k = 0; k < 4; k++) for (int a = 0; a < 4; a++) out[a] += sign * volume * size / 20 * (g[k] + sum) * corner[k][a];
}

static void cut(int i, int j, const double depth[4], double out[4]) {
    const double t = depth[i] / (depth[i] - depth[j]);
    for (int a = 0; a < 4; a++) out[a] = (a == i) * (1 - t) + (a == j) * t;
}

// The layer's force on the nodes of a linear tetrahedron, exactly: rate times depth, integrated over what is in the layer.
static void layer(const double depth[4], double volume, double rate, double out[4]) {
    int in[4], rest[4], n = 0, m = 0; for (int a = 0; a < 4; a++) (depth[a] > 0 ? in[n++] : rest[m++]) = a;
    const double unit[4][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}};
    double f[4] = {}, c[4][4], g[4] = {};
    if (n >= 3) part(unit, depth, volume, 1, f);
    if (n == 1 || n == 3) {
        const int apex = n == 1 ? in[0] : rest[0];
        std::memcpy(c[0], unit[apex], sizeof c[0]); g[0] = depth[apex];
        for (int k = 0; k < 3; k++) { const int other = n == 1 ? rest[k] : in[k]; cut(apex, other, depth, c[k + 1]); }
        part(c, g, volume, n == 1 ? 1 : -1, f);
    }
    if (n == 2) {
        double a[3][4], b[3][4]; const double za[3] = {depth[in[0]], 0, 0}, zb[3] = {depth[in[1]], 0, 0};
        std::memcpy(a[0], unit[in[0]], sizeof a[0]); std::memcpy(b[0], unit[in[1]], sizeof b[0]);
        for (int k = 0; k < 2; k++) cut(in[0], rest[k], depth, a[k + 1]), cut(in[1], rest[k], depth, b[k + 1]);
        const int wedge[3][4] = {{0, 1, 2, 5}, {0, 1, 5, 4}, {0, 4, 5, 3}};
        for (auto &tet : wedge) {
            for (int k = 0; k < 4; k++) { const bool second = tet[k] > 2; const int s = tet[k] % 3; std::memcpy(c[k], second ? b[s] : a[s], sizeof c[k]); g[k] = second ? zb[s] : za[s]; }
            part(c, g, volume, 1, f);
        }
    }
    for (int a = 0; a < 4; a++) out[a] = rate * f[a];
}

static void ground(const Body &b) {
    for (int n = 0; n < b.pieces; n++) {
        const int *p = b.piece + 4 * n; double depth[4], f[4]; bool near = false;
        for (int a = 0; a < 4; a++) depth[a] = b.thickness - b.x[3 * p[a] + 1], near |= depth[a] > 0;
        if (!near) continue;
        layer(depth, b.piece_volume[n], b.rate, f);
        for (int a = 0; a < 4; a++) b.push[p[a]] += f[a];
    }
}

// Friction of every node in the layer: it is held where the forces on it are within the cone, else it slides against a
// constant force. Forces are those but for viscosity, `rate` is viscosity's.
static void rub(const Body &b, const double *rate) {
    for (int n = 0; n < b.node_count; n++) {
        b.held[n] = 0; if (!(b.push[n] > 0)) continue;
        const double *v = b.v + 3 * n, most = b.friction * b.push[n]; double *f = b.force + 3 * n, *way = b.way + 2 * n;
        const double fx = f[0] + rate[3 * n], fz = f[2] + rate[3 * n + 2], size = std::sqrt(fx * fx + fz * fz), speed = std::sqrt(v[0] * v[0] + v[2] * v[2]);
        if (speed == 0 && size <= most) { b.held[n] = 1; continue; }
        b.held[n] = 2; way[0] = speed > 0 ? v[0] / speed : fx / size; way[1] = speed > 0 ? v[2] / speed : fz / size;
        f[0] -= most * way[0]; f[2] -= most * way[1];
    }
}

template <int NN, int NQ> static void run(const Body &b, int steps, double dt) {
    const double down = -std::cos(b.slope), along = std::sin(b.slope);
    const size_t size = 3 * size_t(b.node_count); const int s = b.stages;
    double *before = b.stage, *rate = b.stage + size;
    for (int step = 0; step < steps; step++) {
        std::fill(b.force, b.force + size, 0.0); std::fill(b.push, b.push + b.node_count, 0.0);
        elastic<NN, NQ>(b); ground(b);
        for (int n = 0; n < b.node_count; n++) b.force[3 * n] += along * b.weight[n], b.force[3 * n + 1] += down * b.weight[n] + b.push[n];
        for (int j = 1; j <= s; j++) {
            std::fill(rate, rate + size, 0.0); if (b.eta > 0) viscous<NN, NQ>(b, b.v, rate);
            if (j == 1) rub(b, rate);
            const double mu = (2.0 * j - 1) / j, nu = (1.0 - j) / j, part = mu * dt * 2 / (s * (s + 1.0));
            for (int n = 0; n < b.node_count; n++) for (int i = 0; i < 3; i++) {
                const size_t k = 3 * n + i; const double now = b.v[k], old = j == 1 ? 0 : before[k];
                before[k] = now; b.v[k] = b.held[n] == 1 && i != 1 ? 0 : mu * now + nu * old + part * (b.force[k] + rate[k]) / b.mass[n];
            }
        }
        for (int n = 0; n < b.node_count; n++) {
            double *v = b.v + 3 * n, *x = b.x + 3 * n;
            if (b.held[n] == 2 && v[0] * b.way[2 * n] + v[2] * b.way[2 * n + 1] <= 0) v[0] = v[2] = 0;  // it came to a stop
            for (int i = 0; i < 3; i++) x[i] += dt * v[i];
        }
    }
}

// For every element: largest stiffness and viscosity of its points, as multiples of the reference element's, and least J.
template <int NN, int NQ> static void survey(const Body &b, double *stiff, double *viscosity, double *least) {
    for (int n = 0; n < b.blocks; n++) {
        vec X[NN][3]; gather<NN>(b.cells + size_t(n) * NN * LANES, b.x, X);
        double *out = stiff + n * LANES, *damp = viscosity + n * LANES, *low = least + n * LANES;
        for (int l = 0; l < LANES; l++) out[l] = damp[l] = 0, low[l] = 1e9;
        for (int q = 0; q < NQ; q++) {
            const size_t k = (size_t(n) * NQ + q) * LANES; vec A[3][3], F[3][3], H[3][3];
            reference<NN>(b.slopes + q * NN * 3, X, A); times(A, (const vec *)(b.inverse + k * 9), F); const vec J = inverse_transposed(F, H);
            for (int l = 0; l < LANES; l++) {
                double B[3][3], y[3] = {1, 0.7, -0.5}, z[3], size = 0;  // largest eigenvalue of F^-T F^-1
                for (int r = 0; r < 3; r++) for (int c = 0; c < 3; c++) { B[r][c] = 0; for (int m = 0; m < 3; m++) B[r][c] += H[r][m][l] * H[c][m][l]; }
                for (int it = 0; it < 8; it++) {
                    for (int r = 0; r < 3; r++) z[r] = B[r][0] * y[0] + B[r][1] * y[1] + B[r][2] * y[2];
                    size = std::sqrt(z[0] * z[0] + z[1] * z[1] + z[2] * z[2]); for (int r = 0; r < 3; r++) y[r] = z[r] / size;
                }
                const double log_j = std::log(std::max(J[l], SMALLEST_J)), mu = b.mu[k + l], lam = b.lam[k + l];
                out[l] = std::max(out[l], mu + (mu + lam * std::max(0.0, 1 - log_j)) * size + std::max(0.0, double(b.tension[k + l])));
                damp[l] = std::max(damp[l], 2 * b.eta * size); low[l] = std::min(low[l], double(J[l]));
            }
        }
    }
}

extern "C" {
void run4(const Body *b, int steps, double dt) { run<4, 1>(*b, steps, dt); }
void run10(const Body *b, int steps, double dt) { run<10, 4>(*b, steps, dt); }
void survey4(const Body *b, double *s, double *d, double *j) { survey<4, 1>(*b, s, d, j); }
void survey10(const Body *b, double *s, double *d, double *j) { survey<10, 4>(*b, s, d, j); }
void ground_only(const Body *b) { std::fill(b->push, b->push + b->node_count, 0.0); ground(*b); }
}
