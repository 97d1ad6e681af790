/* The cannon-ball in C, as a person would write it: truth, radar, extended Kalman filter.
 *
 * fly() is one flight on given draws; many() is a loop over flights, on all cores with OpenMP.
 * It stores the analysis (four columns) and the normalised innovation squared.
 */
#include <math.h>

static const double v_0 = 915, g = 9.80665, dt = 0.1, x_R = 30480, y_R = 0;
static const double sigma_theta = 0.01, sigma_r = 30.48;
static const double e[4] = {304.8, -30.48, -304.8, 30.48}, s[4] = {304.8, 30.48, 304.8, 30.48};

static void observe(double x[4], double P[4][4], const double h[4], double r, double d,
                    double *nis) {
    double Ph[4], S = r;
    for (int i = 0; i < 4; i++) Ph[i] = P[i][0] * h[0] + P[i][2] * h[2];
    S += h[0] * Ph[0] + h[2] * Ph[2];
    for (int i = 0; i < 4; i++) {
        double K = Ph[i] / S;
        x[i] += K * d;
        for (int j = 0; j < 4; j++) P[i][j] -= K * Ph[j];
    }
    *nis += d * d / S;
}

void fly(int rows, const double *n_theta, const double *n_r, double *out) {
    double angle = 45 * M_PI / 180, X = 0, Y = 0, VX = v_0 * cos(angle), VY = v_0 * sin(angle);
    double x[4] = {X + e[0], VX + e[1], Y + e[2], VY + e[3]}, P[4][4] = {{0}};
    for (int i = 0; i < 4; i++) P[i][i] = s[i] * s[i];
    for (int t = 0; t < rows; t++) {
        double nis = 0;
        if (t > 0) {
            double new_VY = VY - g * dt;
            X += VX * dt;
            Y += (VY + new_VY) * dt / 2;
            VY = new_VY;
            x[0] += x[1] * dt;
            x[2] += x[3] * dt - g * dt * dt / 2;
            x[3] -= g * dt;
            for (int k = 0; k < 4; k += 2)
                for (int j = 0; j < 4; j++) P[k][j] += dt * P[k + 1][j];
            for (int k = 0; k < 4; k += 2)
                for (int i = 0; i < 4; i++) P[i][k] += dt * P[i][k + 1];
            double theta = atan2(Y - y_R, X - x_R) + sigma_theta * n_theta[t];
            double range = hypot(X - x_R, Y - y_R) + sigma_r * n_r[t];
            double a = x[0] - x_R, b = x[2] - y_R, r2 = a * a + b * b, r = sqrt(r2);
            double f0 = x[0], f2 = x[2];
            double h_theta[4] = {-b / r2, 0, a / r2, 0}, h_r[4] = {a / r, 0, b / r, 0};
            double d = remainder(theta - atan2(b, a), 2 * M_PI);
            observe(x, P, h_theta, sigma_theta * sigma_theta, d, &nis);
            d = range - r - h_r[0] * (x[0] - f0) - h_r[2] * (x[2] - f2);
            observe(x, P, h_r, sigma_r * sigma_r, d, &nis);
        }
        for (int i = 0; i < 4; i++) out[i * rows + t] = x[i];
        out[4 * rows + t] = nis;
    }
}

/* Sums over the flights of x, vx, y, vy and NIS, step by step; out has one block a thread. */
void many(int members, int rows, const double *n_theta, const double *n_r, double *sums) {
#pragma omp parallel
    {
        double out[5 * 4096], own[5 * 4096] = {0};
#pragma omp for
        for (int k = 0; k < members; k++) {
            fly(rows, n_theta + (long)k * rows, n_r + (long)k * rows, out);
            for (int i = 0; i < 5 * rows; i++) own[i] += out[i];
        }
#pragma omp critical
        for (int i = 0; i < 5 * rows; i++) sums[i] += own[i];
    }
}
