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

/* Whether another landmark that there is would read as this code if something lay over bit segment
 * ``at``: over that alone, or also over what looks like it above and below. */
int eye_mistakable(const eye_task *task, const char *code, int segments, int at)
{
    int bits = (segments - 5) / 2, id = eye_decode(code, segments), own = 1 << (at - 3) / 2;
    int hidden = own;
    for (int way = -2; way <= 2; way += 4)
        for (int i = at + way; i > 2 && i < segments - 3; i += way) {
            if (code[at] == '1' || code[i] == '1')
                break;
            hidden |= 1 << (i - 3) / 2;
        }
    for (int other = 1; other < 1 << bits; other++)
        if (task->kinds[other].bits == bits && (other ^ id) & own && !((other ^ id) & ~hidden))
            return 1;
    return 0;
}
