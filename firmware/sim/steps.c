#define _POSIX_C_SOURCE 200809L
#include "sim/steps.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define FORMAT                                                                                     \
    "step %" SCNu64 " %" SCNu64 " %" SCNu8 " %" SCNu16 " %" SCNu16 " %" SCNu16 " %" SCNu16         \
    " %" SCNu16 " %" SCNd32 " %" SCNd32
#define FIELDS 10

void steps_read(struct step *step)
{
    char line[256];
    struct inputs *in = &step->inputs;

    memset(step, 0, sizeof *step);
    if (fgets(line, sizeof line, stdin) == NULL) {
        step->kind = END;
    } else if (strcmp(line, "hang\n") == 0) {
        step->kind = HANG;
    } else if (strcmp(line, "power\n") == 0) {
        step->kind = POWER;
    } else if (sscanf(line, FORMAT, &step->t_us, &step->bytes, &in->stop_button, &in->pan_adc,
                      &in->proximity_mm[0], &in->proximity_mm[1], &in->proximity_mm[2],
                      &in->battery_mv, &in->odometer[0], &in->odometer[1]) == FIELDS) {
        step->kind = STEP;
    } else {
        fprintf(stderr, "polepilot-board: cannot understand the step: %s", line);
        exit(2);
    }
}

static FILE *answers; /* NULL: standard output */

void steps_own_stdout(void)
{
    int own = dup(STDOUT_FILENO);

    answers = own >= 0 ? fdopen(own, "w") : NULL;
    if (answers == NULL || freopen("/dev/null", "w", stdout) == NULL) {
        perror("polepilot-board: standard output");
        exit(2);
    }
}

void steps_answer(uint64_t bytes, const struct outputs *out, unsigned starts)
{
    FILE *to = answers != NULL ? answers : stdout;

    fprintf(to, "%" PRIu64 " %d %d %d %d %u\n", bytes, out->left, out->right, out->steering, out->pan,
            starts);
    (void)fflush(to);
}
