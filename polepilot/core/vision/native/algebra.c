/* Linear equations, and the middle one of some values. */
#include "internal.h"

#include <math.h>

/* Takes so many times one row off another, two numbers at a time. */
static inline void take_off(double *restrict row, const double *restrict other, double share, int n)
{
    int j = 0;
    for (; j + 1 < n; j += 2) {
        row[j] -= share * other[j];
        row[j + 1] -= share * other[j + 1];
    }
    if (j < n)
        row[j] -= share * other[j];
}

/* Solves matrix x = right in place by Cholesky; ``matrix`` (n x n, symmetric, row by row, n at most
 * EYE_MOST_SEGMENTS + 2, of which what is below the diagonal is not asked) is overwritten, ``right``
 * holds ``rights`` columns side by side. 0 where it is not positive. */
int eye_solve(double *matrix, double *right, int n, int rights)
{
    double scale[EYE_MOST_SEGMENTS + 2]; /* of each row: dividing is slow */
    for (int k = 0; k < n; k++) {
        double *row = matrix + k * n, *sums = right + k * rights;
        if (!(row[k] > 0.0))
            return 0;
        scale[k] = 1 / sqrt(row[k]);
        sums[0] *= scale[k];
        for (int c = 1; c < rights; c++)
            sums[c] *= scale[k];
        for (int j = k + 1; j < n; j++)
            row[j] *= scale[k];
        for (int i = k + 1; i < n; i++) {
            take_off(matrix + i * n + i, row + i, row[i], n - i);
            if (rights == 1)
                right[i] -= row[i] * sums[0];
            else
                take_off(right + i * rights, sums, row[i], rights);
        }
    }
    for (int i = n - 1; i >= 0; i--) {
        double *sums = right + i * rights;
        if (rights == 1) {
            double sum = sums[0];
            for (int k = i + 1; k < n; k++)
                sum -= right[k] * matrix[i * n + k];
            sums[0] = sum;
        } else {
            for (int k = i + 1; k < n; k++)
                take_off(sums, right + k * rights, matrix[i * n + k], rights);
        }
        for (int c = 0; c < rights; c++)
            sums[c] *= scale[i];
    }
    return 1;
}

/* The middle one of some values, which are sorted for that; 0 of none. */
double eye_median(double *values, int n)
{
    for (int i = 1; i < n; i++) {
        double value = values[i];
        int at = i;
        for (; at > 0 && values[at - 1] > value; at--)
            values[at] = values[at - 1];
        values[at] = value;
    }
    return n > 0 ? (values[(n - 1) / 2] + values[n / 2]) / 2 : 0;
}
