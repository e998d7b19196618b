/* Numbers as segments and back: two bright, 0 b0 0 b1 0 ..., two bright. */
#include "internal.h"

#include <string.h>

/* The id of a code (top first, '1' = bright), or 0 where it is no legal code. */
int eye_decode(const char *code, int segments)
{
    int id = 0;
    if (code[0] != '1' || code[1] != '1' || code[segments - 1] != '1' || code[segments - 2] != '1')
        return 0;
    for (int i = 2; i < segments - 2; i++) {
        if (code[i] != '1')
            continue;
        if (i % 2 == 0)
            return 0;
        id |= 1 << (i - 3) / 2;
    }
    return id;
}

/* The code of an id, top first. */
void eye_encode(int id, int bits, char *code)
{
    int segments = 2 * bits + 5;
    memset(code, '0', (size_t)segments);
    code[0] = code[1] = code[segments - 1] = code[segments - 2] = '1';
    for (int bit = 0; bit < bits; bit++)
        if (id >> bit & 1)
            code[3 + 2 * bit] = '1';
    code[segments] = '\0';
}

/* Whether another landmark that there is would read as this code if one thing lay over the bit segments
 * ``first`` and ``last``, and over whatever is between them. */
int eye_mistakable(const eye_task *task, const char *code, int segments, int first, int last)
{
    int bits = (segments - 5) / 2, id = eye_decode(code, segments);
    int top = 1 << (first - 3) / 2, bottom = 1 << (last - 3) / 2;
    for (int other = 1; other < 1 << bits; other++) {
        int hidden = other ^ id;
        if (task->kinds[other].bits == bits && hidden & top && hidden & bottom &&
            hidden < 2 * bottom && !(hidden & (top - 1)))
            return 1;
    }
    return 0;
}
