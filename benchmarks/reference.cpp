// The substep of zoobench's solver for one elastic body without muscles or friction: MLS-MPM (Hu et al. 2018) with
// APIC, quadratic splines and a neo-Hookean law, in single precision on one thread. It tells what this machine can do:
// one vector of four lanes per grid node (momentum or velocity, mass) and per column of a matrix, compiled for this
// very processor.
//
// Standard input: grid nodes in x, y, z; spacing [m], step [s], mu and lambda [Pa], gravity in y [m/s^2], volume [m^3]
// and mass [kg] of a particle; warm-up substeps, number of measurements, substeps of each; number of particles, and
// their positions from the first node [m]. Standard output: the processor seconds of each measurement, a line each,
// and then the positions at the end.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <vector>

typedef float vec4 __attribute__((vector_size(16)));

static const int WALL_NODES = 3;
static const float SMALLEST_J = 0.05f;

struct Particle {
    vec4 x, v, C[3], F[3];  // the columns of C and F
};

struct Stencil {
    int first;           // index of its first node
    float offset[3];     // of the particle from there [cells]
    float weight[3][3];  // by node and direction
};

struct Simulation {
    int shape[3];
    float spacing, dt, mu, lambda, gravity, volume, mass;
    std::vector<Particle> particles;
    std::vector<vec4> grid;
    int low[3], high[3];  // the nodes that particles touch

    int index(int i, int j, int k) const { return (i * shape[1] + j) * shape[2] + k; }

    void base(const vec4 &x, int *found) const {
        for (int d = 0; d < 3; d++) found[d] = std::max(0, std::min(int(x[d] / spacing - 0.5f), shape[d] - 3));
    }

    Stencil stencil(const vec4 &x) const {
        Stencil s;
        int first[3];
        base(x, first);
        for (int d = 0; d < 3; d++) {
            const float f = s.offset[d] = x[d] / spacing - first[d];
            s.weight[0][d] = 0.5f * (1.5f - f) * (1.5f - f);
            s.weight[1][d] = 0.75f - (f - 1.0f) * (f - 1.0f);
            s.weight[2][d] = 0.5f * (f - 0.5f) * (f - 0.5f);
        }
        s.first = index(first[0], first[1], first[2]);
        return s;
    }

    // column j of V tau, tau = mu (F F^T - I) + lambda log(J) I
    vec4 stress(const Particle &p, float log_j, int j) const {
        vec4 tau = mu * (p.F[0] * p.F[0][j] + p.F[1] * p.F[1][j] + p.F[2] * p.F[2][j]);
        tau[j] += lambda * log_j - mu;
        return volume * tau;
    }

    void scatter(const Particle &p) {
        const Stencil s = stencil(p.x);
        const vec4 *F = p.F;
        const float J = F[0][0] * (F[1][1] * F[2][2] - F[1][2] * F[2][1]) -
                        F[1][0] * (F[0][1] * F[2][2] - F[0][2] * F[2][1]) +
                        F[2][0] * (F[0][1] * F[1][2] - F[0][2] * F[1][1]);
        const float log_j = std::log(std::max(J, SMALLEST_J));
        vec4 per_cell[3], origin = mass * p.v;
        origin[3] = mass;
        for (int j = 0; j < 3; j++) {  // (m C - 4 dt V tau / h^2) h
            per_cell[j] = (mass * spacing) * p.C[j] - (4.0f * dt / spacing) * stress(p, log_j, j);
            origin -= per_cell[j] * s.offset[j];
        }
#pragma GCC unroll 3
        for (int i = 0; i < 3; i++) {
            const vec4 plane = origin + per_cell[0] * float(i);
#pragma GCC unroll 3
            for (int j = 0; j < 3; j++) {
                const vec4 line = plane + per_cell[1] * float(j);
                const float w = s.weight[i][0] * s.weight[j][1];
                vec4 *node = &grid[s.first + index(i, j, 0)];
                node[0] += line * (w * s.weight[0][2]);
                node[1] += (line + per_cell[2]) * (w * s.weight[1][2]);
                node[2] += (line + per_cell[2] * 2.0f) * (w * s.weight[2][2]);
            }
        }
    }

    void update(int i, int j, int k) {
        vec4 &node = grid[index(i, j, k)];
        if (!(node[3] > 0.0f)) return;
        const int place[3] = {i, j, k};
        vec4 v = node / node[3];
        v[1] += dt * gravity;
        for (int d = 0; d < 3; d++) {
            if (place[d] <= WALL_NODES) v[d] = std::max(v[d], 0.0f);
            if (place[d] >= shape[d] - 1 - WALL_NODES) v[d] = std::min(v[d], 0.0f);
        }
        node = v;
    }

    void gather(Particle &p) {
        const Stencil s = stencil(p.x);
        vec4 v = {0}, moment[3] = {{0}, {0}, {0}};  // sums of w v_i, and of w v_i times the node's place
#pragma GCC unroll 3
        for (int i = 0; i < 3; i++) {
            vec4 plane = {0}, plane_y = {0}, plane_z = {0};
#pragma GCC unroll 3
            for (int j = 0; j < 3; j++) {
                const vec4 *node = &grid[s.first + index(i, j, 0)];
                const vec4 near = node[1] * s.weight[1][2], far = node[2] * s.weight[2][2];
                const vec4 row = (node[0] * s.weight[0][2] + near + far) * s.weight[j][1];
                plane += row;
                plane_y += row * float(j);
                plane_z += (near + far * 2.0f) * s.weight[j][1];
            }
            v += plane * s.weight[i][0];
            moment[0] += plane * (i * s.weight[i][0]);
            moment[1] += plane_y * s.weight[i][0];
            moment[2] += plane_z * s.weight[i][0];
        }
        for (int j = 0; j < 3; j++) {
            p.C[j] = (4.0f / spacing) * (moment[j] - v * s.offset[j]);
            p.C[j][3] = 0.0f;
        }
        v[3] = 0.0f;
        p.v = v;
        p.x += dt * v;
        for (vec4 &column : p.F) column += dt * (p.C[0] * column[0] + p.C[1] * column[1] + p.C[2] * column[2]);
    }

    void measure_window() {
        for (int d = 0; d < 3; d++) low[d] = shape[d], high[d] = 0;
        for (const Particle &p : particles) extend_window(p);
    }

    void extend_window(const Particle &p) {
        int first[3];
        base(p.x, first);
        for (int d = 0; d < 3; d++) low[d] = std::min(low[d], first[d]), high[d] = std::max(high[d], first[d] + 3);
    }

    void substep() {
        for (int i = low[0]; i < high[0]; i++)
            for (int j = low[1]; j < high[1]; j++)
                for (int k = low[2]; k < high[2]; k++) grid[index(i, j, k)] = vec4{0};
        for (const Particle &p : particles) scatter(p);
        for (int i = low[0]; i < high[0]; i++)
            for (int j = low[1]; j < high[1]; j++)
                for (int k = low[2]; k < high[2]; k++) update(i, j, k);
        for (int d = 0; d < 3; d++) low[d] = shape[d], high[d] = 0;
        for (Particle &p : particles) {
            gather(p);
            extend_window(p);
        }
    }
};

int main() {
    Simulation s;
    int warm_up, measurements, substeps, count, read = 0;
    read += std::scanf("%d %d %d", &s.shape[0], &s.shape[1], &s.shape[2]);
    read += std::scanf("%f %f %f %f %f %f %f", &s.spacing, &s.dt, &s.mu, &s.lambda, &s.gravity, &s.volume, &s.mass);
    read += std::scanf("%d %d %d %d", &warm_up, &measurements, &substeps, &count);
    if (read != 14) return 1;
    for (int n = 0; n < count; n++) {
        Particle p = {{0}, {0}, {{0}, {0}, {0}}, {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};
        float x, y, z;
        if (std::scanf("%f %f %f", &x, &y, &z) != 3) return 1;
        p.x = vec4{x, y, z, 0};
        s.particles.push_back(p);
    }
    s.grid.assign(size_t(s.shape[0]) * s.shape[1] * s.shape[2], vec4{0});
    s.measure_window();
    for (int n = 0; n < warm_up; n++) s.substep();
    for (int m = 0; m < measurements; m++) {
        const std::clock_t begin = std::clock();
        for (int n = 0; n < substeps; n++) s.substep();
        std::printf("%.6f\n", double(std::clock() - begin) / CLOCKS_PER_SEC);
    }
    for (const Particle &p : s.particles) std::printf("%.9g %.9g %.9g\n", p.x[0], p.x[1], p.x[2]);
}
