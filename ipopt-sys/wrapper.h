#include "IpoptConfig.h"
#include "guard/guard.h"
