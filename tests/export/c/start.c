/* Start of a program on a Cortex-M4 with semihosting: the stack, the floating-point unit, main. */
#include <stdlib.h>

extern int main(void);
extern void initialise_monitor_handles(void);
extern unsigned __StackTop;

void _init(void)
{
}

void _fini(void)
{
}

static void reset(void)
{
    *(volatile unsigned *)0xE000ED88 |= 0xFu << 20;
    __asm volatile("dsb\nisb");
    initialise_monitor_handles();
    exit(main());
}

static void fault(void)
{
    exit(99);
}

__attribute__((section(".vectors"), used)) void (*const vectors[])(void) = {
    (void (*)(void))&__StackTop, reset, fault, fault, fault, fault, fault
};
