/* Linear equations. */
#include "internal.h"

#include <math.h>

/* Solves matrix x = right in place by Cholesky; ``matrix`` (n x n, symmetric, row by row, n at most
 * EYE_MOST_SEGMENTS + 2) is overwritten, ``right`` holds ``rights`` columns side by side. 0 where it
 * is not positive. */
int eye_solve(double *matrix, double *right, int n, int rights)
{
    double scale[EYE_MOST_SEGMENTS + 2]; /* of each row: dividing is slow */
    for (int i = 0; i < n; i++) {
        for (int j = 0; j <= i; j++) {
            double sum = matrix[i * n + j];
            for (int k = 0; k < j; k++)
                sum -= matrix[i * n + k] * matrix[j * n + k];
            if (i == j) {
                if (!(sum > 0.0))
                    return 0;
                scale[i] = 1 / sqrt(sum);
            } else {
                matrix[i * n + j] = sum * scale[j];
            }
        }
    }
    for (int c = 0; c < rights; c++) {
        for (int i = 0; i < n; i++) {
            double sum = right[i * rights + c];
            for (int k = 0; k < i; k++)
                sum -= matrix[i * n + k] * right[k * rights + c];
            right[i * rights + c] = sum * scale[i];
        }
        for (int i = n - 1; i >= 0; i--) {
            double sum = right[i * rights + c];
            for (int k = i + 1; k < n; k++)
                sum -= matrix[k * n + i] * right[k * rights + c];
            right[i * rights + c] = sum * scale[i];
        }
    }
    return 1;
}
