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

/* The only landmark of whose code this may be a part; 0 where there is none, or where it may be any of
 * several, or one at several places. */
int eye_only_one(const eye_task *task, const char *part, int count)
{
    int only = 0;
    for (int id = 1; id < EYE_IDS; id++) {
        char code[EYE_CODE_SIZE];
        int segments = 2 * task->kinds[id].bits + 5;
        if (task->kinds[id].bits == 0)
            continue;
        eye_encode(id, task->kinds[id].bits, code);
        for (int at = 0; at + count <= segments; at++) {
            if (memcmp(code + at, part, (size_t)count) != 0)
                continue;
            if (only)
                return 0;
            only = id;
        }
    }
    return only;
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
